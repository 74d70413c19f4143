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
    A program that is not a Python package has the ``command`` that takes the script, and is called
    ``tool`` where the script calls it.
    """

    name: str
    script: str
    packages: tuple[str, ...] = ()
    command: tuple[str, ...] = ()
    tool: str = ""


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
_PYMEASURE = """
import numpy as np
from pymeasure.experiment import FloatParameter, Procedure, Results, Worker
run = dict(np.load("run.npz"))
class Lobes(Procedure):
    peak = FloatParameter("Peak voltage", units="kV", default=4.0)
    DATA_COLUMNS = ["Time (s)", "Voltage (kV)", "Displacement (mm)"]
    def execute(self):
        for row in zip(*(run[n].tolist() for n in ("time_s", "voltage_kV", "displacement_mm"))):
            self.emit("results", dict(zip(self.DATA_COLUMNS, row)))
worker = Worker(Results(Lobes(), "run.csv"))
worker.start()
worker.join(timeout=120)
"""
_QCODES = """
from pathlib import Path
import numpy as np
from qcodes.dataset import (
    Measurement, initialise_or_create_database_at, load_or_create_experiment,
)
run = dict(np.load("run.npz"))
made = Path("made")
made.mkdir()
initialise_or_create_database_at(str(made / "runs.db"))
load_or_create_experiment("film", "sample")
measurement = Measurement()
measurement.register_custom_parameter("time", unit="s")
for name, unit in (("voltage", "kV"), ("displacement", "mm")):
    measurement.register_custom_parameter(name, unit=unit, setpoints=("time",))
with measurement.run(write_in_background=False) as saver:
    for t, v, m in zip(run["time_s"], run["voltage_kV"], run["displacement_mm"]):
        saver.add_result(("time", t), ("voltage", v), ("displacement", m))
for kind in ("csv", "netcdf"):
    saver.dataset.export(kind, path=".")
"""
_PYMODAQ = """
from pathlib import Path
import numpy as np
from pymodaq_data.data import Axis, DataRaw
from pymodaq_data.h5modules.data_saving import DataSaverLoader
from pymodaq_data.h5modules.saving import H5SaverLowLevel
run = dict(np.load("run.npz"))
for backend in ("h5py", "tables"):
    saver = H5SaverLowLevel(backend=backend)
    saver.init_file(file_name=Path(backend + ".h5"), new_file=True)
    group = saver.get_set_group("/RawData", "run")
    for name, unit in (("voltage", "kV"), ("displacement", "mm")):
        axis = Axis("time", units="s", data=run["time_s"], index=0)
        data = DataRaw(name, units=unit, data=[run[name + "_" + unit]], labels=[name], axes=[axis])
        DataSaverLoader(saver).add_data(group, data)
    saver.close_file()
"""
_ASAMMDF = """
import numpy as np
from asammdf import MDF, Signal
run = dict(np.load("run.npz"))
names = [n for n in run if n != "time_s"]
with MDF(version="4.10") as file:
    file.append([
        Signal(run[n], run["time_s"], name=n.partition("_")[0], unit=n.partition("_")[2])
        for n in names
    ])
    file.save("run.mf4")
    file.export("csv", "run.csv")
    file.export("csv", "units.csv", add_units=True)
    file.export("mat", "run.mat")
    file.export("hdf5", "run.h5")
"""
_BLUESKY = """
import time
import numpy as np
from bluesky import RunEngine
from bluesky.plan_stubs import close_run, create, open_run, read, save
from suitcase.csv import Serializer
run = dict(np.load("run.npz"))
class Channel:
    parent = None
    def __init__(self, name, unit, values):
        self.name, self.unit, self.values = name, unit, iter(values)
    def read(self):
        return {self.name: {"value": next(self.values), "timestamp": time.time()}}
    def describe(self):
        return {self.name: {"source": "run", "dtype": "number", "shape": [], "units": self.unit}}
    def read_configuration(self):
        return {}
    describe_configuration = read_configuration
def plan(channels):
    yield from open_run()
    for _ in run["time_s"]:
        yield from create("primary")
        for channel in channels:
            yield from read(channel)
        yield from save()
    yield from close_run()
named = [(n, n.partition("_")[2], v.tolist()) for n, v in run.items()]
plain = [(n.partition("_")[0], unit, values) for n, unit, values in named]
for prefix, channels in (("named-", named), ("plain-", plain)):
    RunEngine()(plan([Channel(*c) for c in channels]), Serializer(".", file_prefix=prefix))
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

_SIGROK = """
read="-i run.csv -I csv:header=true:samplerate=200:column_formats=t,2a"
sigrok-cli $read -O csv -o plain.csv
sigrok-cli $read -O csv:time=true:label=channel:dedup=false -o named.csv
sigrok-cli $read -O srzip -o session.sr
"""
_PYTABLES = """
import numpy as np, tables
run = dict(np.load("run.npz"))
units = {n: n.partition("_")[2] for n in run}
with tables.open_file("arrays.h5", "w") as file:
    for name, values in run.items():
        array = file.create_carray("/", name.partition("_")[0], obj=values)
        array.attrs.unit = units[name]
with tables.open_file("table.h5", "w") as file:
    rows = np.rec.fromarrays(list(run.values()), names=list(run))
    table = file.create_table("/rig", "run", obj=rows, createparents=True)
    table.cols.time_s.create_csindex()
"""

PROGRAMS = (
    Program("pandas", _PANDAS, ("pandas==3.1.1", "tables==3.11.1", "openpyxl==3.1.5")),
    Program("openpyxl", _OPENPYXL, ("openpyxl==3.1.5", "numpy==2.4.6")),
    Program("npTDMS", _NPTDMS, ("npTDMS==1.13.0", "numpy==2.4.6")),
    Program("mat-io", _MATIO, ("mat-io==1.0.2", "numpy==2.4.6")),
    Program("Sigima", _SIGIMA, ("sigima==1.3.0",)),
    Program("PyTables", _PYTABLES, ("tables==3.11.1", "numpy==2.4.6")),
    Program("PyMeasure", _PYMEASURE, ("PyMeasure==0.16.0", "numpy==2.4.6")),
    Program("QCoDeS", _QCODES, ("qcodes==0.58.0",)),
    Program(
        "PyMoDAQ",
        _PYMODAQ,
        ("pymodaq_data==5.3.0", "h5py==3.16.0", "tables==3.11.1", "numpy==2.4.6"),
    ),
    Program(
        "asammdf", _ASAMMDF, ("asammdf==8.8.28", "scipy==1.17.1", "h5py==3.16.0", "numpy==2.4.6")
    ),
    Program("suitcase-csv", _BLUESKY, ("suitcase-csv==0.3.0", "bluesky==1.15.1", "numpy==2.4.6")),
    Program("Octave", _OCTAVE, command=("octave-cli", "--norc")),
    Program("sigrok-cli", _SIGROK, command=("sh",), tool="sigrok-cli"),
)
