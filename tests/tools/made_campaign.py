"""Made tables of a campaign: films that age in a room that warms and moistens, with known truth."""

from __future__ import annotations

import math
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np

#: Relative change of each number per unit of each column.
TRUTH = {
    "mu_0_kPa": {"temperature": -0.006, "humidity": -0.0025, "cycles": -0.012},
    "permittivity": {"temperature": -0.002, "humidity": 0.0016, "cycles": 0.0},
}
LEVEL = {"mu_0_kPa": 55.0, "permittivity": 4.7}
_BEGIN = datetime(2026, 11, 2, 8, tzinfo=UTC)


def made_rows(
    seed: int,
    films: int = 20,
    runs: int = 10,
    *,
    error: float = 0.01,
    scatter: float = 0.005,
    between: float = 0.06,
    own: dict[str, float] | None = None,
    jump: tuple[str, int, float] | None = None,
) -> list[dict[str, Any]]:
    """Rows of a study of ``films`` with ``runs`` each, one film after the other, 20 runs a day.

    ``error`` is the median standard error of a fit, ``scatter`` what lies beyond it, ``between``
    the deviation between films; all relative. ``own`` has slopes of mu_0 against temperature that
    single films have in addition, ``jump`` a film, a run and the relative jump of its mu_0.
    """
    random = np.random.default_rng(seed)
    rows: list[dict[str, Any]] = []
    levels = {n: between * random.standard_normal(films) for n in TRUTH}
    phase = random.uniform(0.0, 2.0 * math.pi, 2)
    for film in range(films):
        name = f"F{film + 1:02d}"
        cycles = 0.0
        for run in range(runs):
            place = (film * runs + run) / (films * runs)
            day = (film * runs + run) / 20.0
            # the season warms and moistens the room, the heating comes and goes each day
            temperature = 20.0 + 4.0 * place + 2.5 * math.sin(2.0 * math.pi * day + phase[0])
            temperature += 0.3 * random.standard_normal()
            humidity = 35.0 + 15.0 * place + 6.0 * math.sin(1.7 * math.pi * day + phase[1])
            humidity += random.standard_normal()
            row: dict[str, Any] = {
                "recording": f"{name}-{run + 1:02d}.h5",
                "state": "ok",
                "reason": "",
                "started": (_BEGIN + timedelta(days=day)).isoformat(),
                "film": name,
                "rig": "sim",
                "temperature_degC": temperature,
                "relative_humidity_percent": humidity,
                "cycles": 500.0 + 50.0 * float(random.integers(0, 20)),
            }
            for number, slopes in TRUTH.items():
                s = error * random.uniform(0.5, 1.5)
                y = math.log(LEVEL[number]) + levels[number][film]
                y += slopes["temperature"] * (temperature - 22.0)
                y += slopes["humidity"] * (humidity - 45.0) + slopes["cycles"] * cycles / 1e3
                if number == "mu_0_kPa":
                    y += (own or {}).get(name, 0.0) * (temperature - 22.0)
                    if jump is not None and jump[0] == name and run >= jump[1]:
                        y += math.log1p(jump[2])
                y += s * random.standard_normal() + scatter * random.standard_normal()
                row[number] = math.exp(y)
                row[f"{number}_low95"] = math.exp(y - 1.96 * s)
                row[f"{number}_high95"] = math.exp(y + 1.96 * s)
                row[f"{number}_determined"] = True
            row["rms_um"] = 1.0 + 0.1 * abs(random.standard_normal())
            cycles += row["cycles"]
            rows.append(row)
    return rows
