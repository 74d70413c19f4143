"""Choice of the column for each quantity, and the values of a recording from them."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from dearig.errors import InputError
from dearig.recording.importers.columns import (
    QUANTITIES,
    TARGETS,
    Scale,
    misnamed,
    names_of,
    suggestion,
)
from dearig.recording.importers.source import Source, listing
from dearig.recording.timestamps import not_forward

__all__ = ["Chosen"]

#: Where the optional columns go, by quantity.
OPTIONAL = MappingProxyType(
    {
        "voltage_monitor": "voltage_monitor",
        "current": "current_monitor",
        "temperature": "temperature",
    }
)


class Chosen:
    """The columns of ``source`` that hold each quantity."""

    def __init__(self, source: Source, mapping: Mapping[str, str]) -> None:
        self.source = source
        #: quantity: name with unit, column of the source, scale
        self.picked: dict[str, tuple[str, str, Scale]] = {}
        for name, column in mapping.items():
            if name not in TARGETS:
                hints = [hint for q in QUANTITIES if (hint := misnamed(q, [name]))]
                raise InputError(
                    f"{name!r} is not a column of a recording"
                    + (f" ({hints[0]})" if hints else suggestion([name], TARGETS))
                    + f"; there are: {', '.join(TARGETS)}"
                )
            quantity = TARGETS[name]
            if quantity in self.picked:
                raise InputError(
                    f"{quantity} is given twice, as {self.picked[quantity][0]} and as {name}"
                )
            source.check(column)
            self.picked[quantity] = (name, column, QUANTITIES[quantity][name])
        for quantity, names in QUANTITIES.items():
            if quantity in self.picked:
                continue
            found = [(name, column) for name in names for column in source.named(name)]
            if len(found) > 1:
                raise InputError(
                    f"{source.path}: {quantity} is there {len(found)} times "
                    f"({listing([column for _, column in found])}); choose one with "
                    f"--column {found[0][0]}={found[0][1]}, or rename the others"
                )
            if found:
                name, column = found[0]
                source.check(column)
                self.picked[quantity] = (name, column, names[name])

    def kind(self, warnings: list[str]) -> str:
        """Return the kind of the data: ``actuator`` or ``film``."""
        there = self.picked.keys()
        film = [q for q in ("stretch", "nominal_stress") if q in there]
        if "voltage" in there and film:
            raise InputError(
                f"{self.source.path} has both voltage and {' and '.join(film)}: actuator data are "
                f"driven by voltage, film data by stretch; import a file with the columns of one"
            )
        if "voltage" in there:
            if "force" in there:
                warnings.append("the force was not used: actuator data have none")
            return "actuator"
        if film or "force" in there:
            return "film"
        hints = [
            h for q in ("voltage", "stretch", "nominal_stress", "force") if (h := self._hint(q))
        ]
        raise InputError(
            f"{self.source.path} has no column for voltage ({names_of('voltage')}), nor for film "
            f"data ({names_of('stretch')}, {names_of('nominal_stress')}, {names_of('force')}); "
            f"there are: {listing(self.source.names)}{hints[0] if hints else ''}"
        )

    def actuator(self) -> dict[str, np.ndarray]:
        """Return the values of a recording of kind actuator."""
        for quantity in ("time", "displacement"):
            self._need(quantity)
        found = self._read(["time", "voltage", "displacement", *OPTIONAL])
        return {
            "time": found["time"],
            "displacement": found["displacement"],
            "voltage_command": found["voltage"],
        } | {OPTIONAL[q]: found[q] for q in OPTIONAL if q in found}

    def film(
        self, gauge_length_mm: float | None, area_mm2: float | None, warnings: list[str]
    ) -> dict[str, np.ndarray]:
        """Return the values of a recording of kind film."""
        self._need("time")
        path = self.source.path
        there = self.picked.keys()
        wanted = ["time", "temperature"]
        if "stretch" in there:
            wanted.append("stretch")
            if gauge_length_mm is not None:
                warnings.append("the gauge length was not used: there is a column of stretch")
        elif "displacement" in there:
            wanted.append("displacement")
            if gauge_length_mm is None:
                raise InputError(
                    f"{path} has displacement and no stretch; give the specimen's length at rest "
                    f"with --gauge-length-mm"
                )
        else:
            self._need("stretch", "or displacement with --gauge-length-mm")
        if "nominal_stress" in there:
            wanted.append("nominal_stress")
            if area_mm2 is not None:
                warnings.append("the area was not used: there is a column of nominal stress")
        elif "force" in there:
            wanted.append("force")
            if area_mm2 is None:
                raise InputError(
                    f"{path} has force and no nominal stress; give the specimen's cross-section "
                    f"at rest with --area-mm2"
                )
        else:
            self._need("nominal_stress", "or force_N with --area-mm2")
        found = self._read(wanted)
        if gauge_length_mm is not None and "displacement" in found:
            found["stretch"] = 1.0 + found.pop("displacement") / (gauge_length_mm / 1e3)
        if area_mm2 is not None and "force" in found:
            found["nominal_stress"] = found.pop("force") / (area_mm2 / 1e6)
        low = np.flatnonzero(found["stretch"] <= 0.0)
        if low.size:
            raise InputError(
                f"{path}, {self.source.row(int(low[0]))}: stretch is "
                f"{found['stretch'][low[0]]:.6g}; it is length over length at rest, and above 0"
            )
        return found

    def left_out(self) -> list[str]:
        """Return a sentence for each optional column that was not read for its unknown unit."""
        hints = [misnamed(q, self.source.names) for q in OPTIONAL if q not in self.picked]
        return [f"{hint}; it was not imported" for hint in hints if hint]

    def _hint(self, quantity: str) -> str:
        hint = misnamed(quantity, self.source.names)
        return f"; {hint}" if hint else suggestion(QUANTITIES[quantity], self.source.names)

    def _need(self, quantity: str, otherwise: str = "") -> None:
        if quantity in self.picked:
            return
        raise InputError(
            f"{self.source.path} has no column for {quantity} "
            f"({names_of(quantity)}{', ' if otherwise else ''}{otherwise}); there are: "
            f"{listing(self.source.names)}{self._hint(quantity)}"
        )

    def _read(self, quantities: list[str]) -> dict[str, np.ndarray]:
        """Return the checked values of ``quantities`` that exist, in the recording's units."""
        path, row = self.source.path, self.source.row
        picked = {q: self.picked[q] for q in quantities if q in self.picked}
        raw = self.source.read([column for _, column, _ in picked.values()])
        sizes = {column: raw[column].size for _, column, _ in picked.values()}
        if len(set(sizes.values())) > 1:
            different = ", ".join(f"{column} {size}" for column, size in sizes.items())
            raise InputError(f"{path}: the columns have different lengths: {different}")
        found = {}
        for quantity, (_, column, (times, over)) in picked.items():
            values = raw[column]
            finite = np.isfinite(values)
            if not finite.all():
                at = int(np.argmin(finite))
                raise InputError(
                    f"{path}, {row(at)}, column {column!r}: {values[at]} is not a finite number; "
                    f"leave the row out or correct it"
                )
            found[quantity] = values * times / over
        seconds, name = found["time"], picked["time"][1]
        if seconds.size < 2:
            raise InputError(f"{path} has {seconds.size} row of data; at least 2 are needed")
        if (back := not_forward(seconds)) is not None:
            at, how = back
            raise InputError(
                f"{path}, {row(at)}, column {name!r}: time {how}, from {seconds[at - 1]:.9g} s to "
                f"{seconds[at]:.9g} s; leave the rows out or correct them"
            )
        return found
