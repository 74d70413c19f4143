"""The programs, their pinned packages, and what each writes from the same run.

A script runs in an environment with the packages. It finds the columns in ``run.npz`` in its
folder, and writes its files there. Nothing of this project is in that environment.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["PROGRAMS", "Program"]


@dataclass(frozen=True)
class Program:
    """A program that writes measured data.

    ``packages`` are pinned requirements, the first one is the program; ``script`` writes the files.
    A program that is no Python package has the ``command`` that takes the script.
    """

    name: str
    script: str
    packages: tuple[str, ...] = ()
    command: tuple[str, ...] = ()


_PANDAS = """
import numpy as np, pandas as pd
run = dict(np.load("run.npz"))
table = pd.DataFrame(run)
table.to_csv("plain.csv", index=False)
table.set_index("time_s").to_csv("index.csv")
table.to_csv("counter.csv")
table.to_json("columns.json")
table.to_json("records.json", orient="records")
table.set_index("time_s").to_json("float_index.json")
table.to_json("split.json", orient="split")
table.to_excel("plain.xlsx", index=False)
table.to_hdf("fixed.h5", key="run", format="fixed")
table.to_hdf("table.h5", key="run", format="table")
table.to_hdf("data_columns.h5", key="run", format="table", data_columns=True)
timed = table.drop(columns="time_s")
timed.index = pd.TimedeltaIndex(pd.to_timedelta(run["time_s"], unit="s"), name="time")
timed.to_csv("timedelta.csv")
timed.to_hdf("timedelta.h5", key="run", format="table")
timed.index = pd.Timestamp("2026-03-02 12:00") + timed.index
timed.index.name = "time"
timed.to_csv("datetime.csv")
timed.to_hdf("datetime.h5", key="run", format="table")
timed.to_hdf("datetime_fixed.h5", key="run", format="fixed")
levels = table.copy()
levels.columns = pd.MultiIndex.from_product([["rig"], table.columns])
levels.to_csv("levels.csv", index=False)
levels.to_hdf("levels.h5", key="run", format="fixed")
"""
_OPENPYXL = """
import numpy as np
from openpyxl import Workbook
run = dict(np.load("run.npz"))
for name, more in (("plain", []), ("unnamed", [7.0])):
    book = Workbook()
    book.active.append(["Time (s)", "Displacement (mm)", "Voltage (kV)"])
    for t, v, m in zip(run["time_s"], run["voltage_kV"], run["displacement_mm"]):
        book.active.append([float(t), float(m), float(v), *more])
    book.save(name + ".xlsx")
"""
_NPTDMS = """
import numpy as np
from nptdms import ChannelObject, TdmsWriter
run = dict(np.load("run.npz"))
step = float(run["time_s"][1] - run["time_s"][0])
with TdmsWriter("waveform.tdms") as writer:
    writer.write_segment([
        ChannelObject("rig", name.partition("_")[0], run[name],
                      {"unit_string": name.partition("_")[2], "wf_increment": step,
                       "wf_start_offset": 0.0, "wf_samples": len(run[name])})
        for name in ("voltage_kV", "displacement_mm")
    ])
with TdmsWriter("columns.tdms") as writer:
    writer.write_segment([ChannelObject("rig", n, v) for n, v in run.items()])
"""
_MATIO = """
import numpy as np
from matio import save_to_mat
run = {n: v[:, None] for n, v in np.load("run.npz").items()}
save_to_mat("v7.mat", run)
save_to_mat("v73.mat", run, version="v7.3")
"""
_SIGIMA = """
import numpy as np
from sigima.io import write_signal
from sigima.objects import create_signal
run = dict(np.load("run.npz"))
signal = create_signal("Displacement", run["time_s"], run["displacement_mm"],
                       units=("s", "mm"), labels=("Time", "Displacement"))
write_signal("displacement.h5sig", signal)
write_signal("displacement.csv", signal)
"""
_OCTAVE = """
run = load("-text", "run.txt");
time_s = run.time_s; voltage_kV = run.voltage_kV; displacement_mm = run.displacement_mm;
save("default.mat", "time_s", "voltage_kV", "displacement_mm");
save("-v7", "v7.mat", "time_s", "voltage_kV", "displacement_mm");
save("-hdf5", "hdf5.h5", "time_s", "voltage_kV", "displacement_mm");
data.time_s = time_s; data.voltage_kV = voltage_kV; data.displacement_mm = displacement_mm;
save("struct.mat", "data");
save("-hdf5", "struct.h5", "data");
"""

PROGRAMS = (
    Program("pandas", _PANDAS, ("pandas==3.1.1", "tables==3.11.1", "openpyxl==3.1.5")),
    Program("openpyxl", _OPENPYXL, ("openpyxl==3.1.5", "numpy==2.4.6")),
    Program("npTDMS", _NPTDMS, ("npTDMS==1.13.0", "numpy==2.4.6")),
    Program("mat-io", _MATIO, ("mat-io==1.0.2", "numpy==2.4.6")),
    Program("Sigima", _SIGIMA, ("sigima==1.0.5",)),
    Program("Octave", _OCTAVE, command=("octave-cli", "--norc")),
)
