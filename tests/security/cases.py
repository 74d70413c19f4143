"""Inputs made to harm: each is one file or folder, and the command that is given it."""

from __future__ import annotations

import io
import os
import socket
import struct
import tomllib
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import tomli_w
from openpyxl import Workbook

from tests.tools.command import LOBE, thesis_model
from tests.tools.recordings import write_run

__all__ = ["CASES", "INPUTS", "SPECIAL_FILES", "Case"]

MILLION = 10**6


@dataclass(frozen=True)
class Case:
    """``make`` writes into a folder and returns the arguments; the answer says all ``words``.

    ``code`` is the exit code; None if the input may also be good.
    """

    make: Callable[[Path], list[str]]
    words: tuple[str, ...] = ()
    code: int | None = 2


def _text(path: Path, text: str) -> str:
    path.write_text(text, encoding="utf-8")
    return str(path)


Text = str | Callable[[], str]  # what is long is made when it is written


def _whole(text: Text) -> str:
    return text if isinstance(text, str) else text()


def _record(text: Text) -> Callable[[Path], list[str]]:
    def make(folder: Path) -> list[str]:
        sequence = _text(folder / "s.toml", _whole(text))
        return ["record", sequence, "--rig", "sim", "--out", str(folder / "out.h5")]

    return make


def _rig_file(text: Text) -> Callable[[Path], list[str]]:
    return lambda folder: ["check", "--rig-file", _text(folder / "r.toml", _whole(text))]


def _model(change: Callable[[dict[str, Any]], object]) -> Callable[[Path], list[str]]:
    def make(folder: Path) -> list[str]:
        data = tomllib.loads(thesis_model(folder / "good.toml").read_text(encoding="utf-8"))
        change(data)
        model = _text(folder / "m.toml", tomli_w.dumps(data))
        drive = _text(folder / "s.toml", LOBE)
        return ["simulate", model, "--drive", drive, "--out", str(folder / "out.csv")]

    return make


def _import(name: str, content: Callable[[], bytes]) -> Callable[[Path], list[str]]:
    def make(folder: Path) -> list[str]:
        (folder / name).write_bytes(content())
        return ["import", str(folder / name), "--out", str(folder / "out.h5")]

    return make


def _recording(
    change: Callable[[h5py.File, Path], None], *command: str
) -> Callable[[Path], list[str]]:
    def make(folder: Path) -> list[str]:
        run = folder / "run.h5"
        write_run(run)
        with h5py.File(run, "r+") as file:
            change(file, folder)
        return [command[0], str(run), *command[1:]] if command else ["info", str(run)]

    return make


SEGMENT = '[[segment]]\nkind = "hold"\nduration_s = 1.0\n'
HEAD = 'name = "x"\n'
BRANCH = {"spring": "gent", "modulus_Pa": 1000.0, "limit": 100.0, "relaxation_time_s": 1.0}
EFFECT = {"name": "x", "values": {}}

SEQUENCES = {
    "100,000 tables": Case(_record(HEAD + "[[a]]\n" * 100_000), ("tables",)),
    "1,000,000 segments": Case(_record(lambda: HEAD + SEGMENT * MILLION), ("s.toml", "MB")),
    "30,000 segments": Case(_record(HEAD + SEGMENT * 30_000), ("s.toml",)),
    "10,000 segments": Case(_record(HEAD + SEGMENT.replace("1.0", "0.01") * 10_000), code=0),
    "10,000 wrong segments": Case(_record(HEAD + '[[segment]]\nkind = "x"\n' * 10_000), ("kind",)),
    "100,000 tables in one line": Case(_record(f"{HEAD}a = [{'{},' * 100_000}]"), ("values",)),
    "100,000 keys": Case(_record("".join(f"k{i} = 1\n" for i in range(100_000)) + HEAD), ("keys",)),
    "a table of 100,000 tables": Case(
        _record(HEAD + "".join(f"[a.k{i}]\n" for i in range(100_000))), ("tables",)
    ),
    "brackets in brackets": Case(_record("a = " + "[" * 100_000), ("nested",)),
    "tables in tables": Case(_record("a = " + "{a = " * 100_000), ("nested",)),
    "a key of 100,000 parts": Case(_record("a" + ".a" * 100_000 + " = 1"), ("nested",)),
    "a header of 100,000 parts": Case(_record("[a" + ".a" * 100_000 + "]"), ("nested",)),
    "33 parts": Case(_record("a" + ".a" * 32 + f" = 1\n{HEAD}"), ("nested",)),
    "quoted parts": Case(_record('["a"' + '."a"' * 100_000 + "]"), ("nested",)),
    "spaced parts": Case(_record("a" + " . a" * 100_000 + " = 1"), ("nested",)),
    "900 brackets": Case(_record(f"{HEAD}a = {'[' * 900}{']' * 900}\n{SEGMENT}"), ("nested",)),
    "a key of 1 MB": Case(_record("a" * MILLION + ' = 1\nname = "x"\n'), ("characters",)),
    "a name of 50 MB": Case(_record(lambda: f'name = "{"x" * 50 * MILLION}"\n{SEGMENT}'), ("MB",)),
    "a name of 1 MB": Case(_record(f'name = "{"x" * MILLION}"\n{SEGMENT}'), ("name",)),
    "a kind of 1 MB": Case(_record(f'{HEAD}[[segment]]\nkind = "{"x" * MILLION}"\n'), ("kind",)),
    "a file name of 1 MB": Case(
        _record(f'{HEAD}[[segment]]\nkind = "csv"\nfile = "{"x" * MILLION}"\n'), ("file",)
    ),
    "hexadecimal number of 100,000 digits": Case(
        _record(f"{HEAD}[[segment]]\nkind = 'hold'\nduration_s = 0x{'f' * 100_000}\n"),
        ("64 bits",),
    ),
    "number of 100,000 digits": Case(_record(f"{HEAD}a = {'9' * 100_000}"), ("digits",)),
    "number with underscores": Case(_record(f"{HEAD}a = {'9_' * 50_000}9"), ("digits",)),
    "1e400": Case(
        _record(f"{HEAD}[[segment]]\nkind = 'hold'\nduration_s = 1e400\n"), ("duration_s",)
    ),
    "fraction of 1 MB": Case(
        _record(f"{HEAD}[[segment]]\nkind = 'hold'\nduration_s = 0.{'1' * MILLION}\n"), code=None
    ),
    "levels that are not numbers": Case(
        _record(
            f"{HEAD}[[segment]]\nkind = 'steps'\ndwell_s = 1.0\nlevels_kV = [{'true,' * 10_000}]"
        ),
        ("levels_kV",),
    ),
    "200,000 levels": Case(
        _record(
            f"{HEAD}[[segment]]\nkind = 'steps'\ndwell_s = 1.0\nlevels_kV = [{'0.0,' * 200_000}]"
        ),
        code=None,
    ),
    "200,000 tones": Case(
        _record(
            f"{HEAD}[[segment]]\nkind = 'multisine'\nduration_s = 1e5\n"
            f"amplitudes_kV = [{'0.001,' * 100_000}]\nfrequencies_Hz = [{'0.1,' * 100_000}]"
        ),
    ),
    "thesis of 100,000 lobes": Case(
        _record(
            f"{HEAD}[[segment]]\nkind = 'thesis'\nperiods = 1000000000\n"
            f"amplitudes_kV = [{'0.1,' * 100_000}]\nfrequencies_Hz = [{'1.0,' * 100_000}]"
        ),
    ),
    "text without end": Case(_record('name = """' + "x\\n" * 300_000), ("s.toml",)),
    "2 MB of quotation marks": Case(_record('"' * 2 * MILLION), ("s.toml",)),
    "2 MB of words": Case(_record("word " * 400_000), ("s.toml",)),
    "2 MB of dots": Case(_record("." * 2 * MILLION), ("s.toml",)),
    "2 MB of digits": Case(_record("1" * 2 * MILLION), ("s.toml",)),
    "2 MB of spaces": Case(_record(" " * 2 * MILLION + "="), ("s.toml",)),
    "2 MB of line ends": Case(_record("\n" * 2 * MILLION), ("name",)),
    "2 MB of comments": Case(_record("#\n" * MILLION), ("name",)),
    "zero bytes": Case(_record("\0" * MILLION), ("s.toml",)),
}

RIG_FILES = {
    "80,000 channels": Case(_rig_file('[[channel]]\nname = "x"\n' * 80_000), ("tables",)),
    "10,000 channels": Case(_rig_file('[[channel]]\nname = "x"\n' * 10_000), ("channel",)),
    "rig file of 50 MB": Case(_rig_file(lambda: "#" * 50 * MILLION), ("MB",)),
    "film of 1 MB": Case(_rig_file(f'[film]\nname = "{"x" * MILLION}"\n'), ("film.name",)),
    "port of 1 MB": Case(_rig_file(f'[laser]\nport = "{"x" * MILLION}"\n'), code=None),
    "unknown keys": Case(
        _rig_file("[film]\n" + "".join(f"k{i} = 1\n" for i in range(50_000))), ("keys",)
    ),
}

MODELS = {
    "10,000 branches": Case(_model(lambda m: m.update(branch=[BRANCH] * 10_000)), ("branch",)),
    "100 branches": Case(_model(lambda m: m.update(branch=[BRANCH] * 100)), code=0),
    "10,000 effects": Case(_model(lambda m: m.update(effect=[EFFECT] * 10_000)), ("effect",)),
    "an effect of 100,000 values": Case(
        _model(
            lambda m: m.update(
                effect=[{"name": "x", "values": {f"k{i}": 1.0 for i in range(100_000)}}]
            )
        ),
        ("keys",),
    ),
    "model's name of 1 MB": Case(_model(lambda m: m.update(name="x" * MILLION)), ("name",)),
    "modulus of 1e400 Pa": Case(
        _model(lambda m: m["equilibrium"].update(modulus_Pa=float("inf"))), ("modulus_Pa",)
    ),
    "time of 1e308 s": Case(
        _model(lambda m: m["branch"][0].update(relaxation_time_s=1e308)), code=None
    ),
    "time of 1e-308 s": Case(
        _model(lambda m: m["branch"][0].update(relaxation_time_s=1e-308)), code=None
    ),
    "modulus of 1e308 Pa": Case(
        _model(lambda m: m["equilibrium"].update(modulus_Pa=1e308)), code=None
    ),
    "film of 1e-300 m": Case(_model(lambda m: m["film"].update(thickness_m=1e-300)), code=None),
    "mass of 1e308 kg": Case(_model(lambda m: m["load"].update(mass_kg=1e308)), code=None),
    "history of 9,000 tables": Case(
        _model(lambda m: m.update(history={"a": [{"b": 1}] * 9000})), code=None
    ),
}


def _mat(kind: int, body: bytes) -> bytes:
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    return head + struct.pack("<2I", kind, len(body)) + body


def _mat_bomb() -> bytes:
    # a piece that refers to nothing before it may follow itself any number of times
    packer = zlib.compressobj(9)
    head = packer.compress(b"") + packer.flush(zlib.Z_FULL_FLUSH)
    piece = packer.compress(bytes(2**20)) + packer.flush(zlib.Z_FULL_FLUSH)
    return _mat(15, head + piece * 2**11)


def _mat_claim() -> bytes:
    flags = struct.pack("<2I2I", 6, 8, 6, 0)
    shape = struct.pack("<2I2i", 5, 8, 2**31 - 1, 2**31 - 1)
    name = struct.pack("<2I8s", 1, 1, b"a")
    return _mat(14, flags + shape + name + struct.pack("<2I", 9, 0))


def _tdms_claim() -> bytes:
    meta = struct.pack("<I", 3)
    for name in (b"time_s", b"voltage_V", b"displacement_m"):
        path = b"/'g'/'" + name + b"'"
        meta += struct.pack("<I", len(path)) + path
        meta += struct.pack("<IIIQI", 20, 10, 1, 10**12, 0)
    return struct.pack("<4sIIQQ", b"TDSm", 0b1110, 4713, len(meta) + 8, len(meta)) + meta + bytes(8)


SHEETS = b"http://schemas.openxmlformats.org/spreadsheetml/2006/main"


def _workbook(rows: bytes, before: bytes = b"", texts: bytes = b"") -> bytes:
    """Return a workbook of one sheet with ``rows``, and ``before`` in front of it."""
    file = io.BytesIO()
    book = Workbook()
    book.active.append(["time_s"])
    book.save(file)
    with zipfile.ZipFile(file) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    sheet = b'<worksheet xmlns="%b"><sheetData>%b</sheetData></worksheet>' % (SHEETS, rows)
    parts["xl/worksheets/sheet1.xml"] = before + sheet
    parts["xl/sharedStrings.xml"] = b'<sst xmlns="%b">%b</sst>' % (SHEETS, texts)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return packed.getvalue()


def _hdf5_claim() -> bytes:
    content = io.BytesIO()
    with h5py.File(content, "w") as file:
        file.create_dataset("time_s", shape=(10**12,), chunks=(1000,), dtype="f8")
    return content.getvalue()


COLUMNS = b"time_s,voltage_V,displacement_m\n"
IMPORTS = {
    "CSV of one line of 30 MB": Case(_import("a.csv", lambda: b"1," * 15 * MILLION), ("a.csv",)),
    "CSV of 1,000,000 columns": Case(
        _import("a.csv", lambda: b",".join(b"c%d" % i for i in range(MILLION)) + b"\n1\n"),
        ("columns",),
    ),
    "CSV of 100,000 columns of one name": Case(
        _import("a.csv", lambda: b"time_s," * 100_000 + b"\n" + b"1," * 100_000), ("a.csv",)
    ),
    "CSV of line ends": Case(_import("a.csv", lambda: b"\n" * 20 * MILLION), ("empty",)),
    "CSV of commas": Case(_import("a.csv", lambda: COLUMNS + b"," * 10 * MILLION), ("no data",)),
    "CSV of quotation marks": Case(_import("a.csv", lambda: COLUMNS + b'"' * 10 * MILLION)),
    "CSV with a number of 10 MB": Case(
        _import("a.csv", lambda: COLUMNS + b"0,0," + b"1" * 10 * MILLION + b"\n1,1,1\n"), code=None
    ),
    "CSV of 1e400": Case(
        _import("a.csv", lambda: COLUMNS + b"0,0,0\n1,1e400,1\n"), ("line 3", "finite")
    ),
    "CSV with a wrong last line": Case(
        _import(
            "a.csv",
            lambda: COLUMNS + b"".join(b"%d,0,0\n" % i for i in range(500_000)) + b"x,1,1\n",
        ),
        ("line 500002",),
    ),
    "CSV of zero bytes": Case(_import("a.csv", lambda: bytes(10 * MILLION)), ("a.csv",)),
    "MAT that unpacks to 2 GB": Case(_import("a.mat", _mat_bomb), ("unpacks",)),
    "MAT that claims 4e18 numbers": Case(_import("a.mat", _mat_claim), ("a.mat",)),
    "CSV of 10,000,000 lines of names": Case(
        _import("a.csv", lambda: b"a;b\n1;2\n3;4\n" + b"a;b\n" * 10 * MILLION), ("a.csv",)
    ),
    "JSON of arrays in arrays": Case(_import("a.json", lambda: b"[" * MILLION), ("nested",)),
    "JSON of 1,000,000 arrays": Case(
        _import("a.json", lambda: b"[" + b"[]," * MILLION + b"[]]"), ("no columns",)
    ),
    "JSON of 1,000,000 objects": Case(
        _import("a.json", lambda: b"[" + b'{"a":1},' * MILLION + b"{}]"), ("a.json",)
    ),
    "JSON of 1,000,000 names": Case(
        _import("a.json", lambda: b"{%b}" % b",".join(b'"%d":[1,2]' % i for i in range(MILLION))),
        ("a.json",),
    ),
    "HDF5 that claims 1e12 numbers": Case(_import("a.h5", _hdf5_claim), ("no columns",)),
    "workbook that unpacks to 128 MB": Case(
        _import("a.xlsx", lambda: _workbook(b" " * 2**27)), ("unpacks",)
    ),
    "workbook with entities in entities": Case(
        _import("a.xlsx", lambda: _workbook(b"", b'<!DOCTYPE a [<!ENTITY b "bbbb">]>')),
        ("does not begin",),
    ),
    "workbook with 1,000,000 texts": Case(
        _import("a.xlsx", lambda: _workbook(b"", texts=b"<si/>" * MILLION)), ("unpacks",)
    ),
    "TDMS that claims 1e12 samples": Case(_import("a.tdms", _tdms_claim), ("a.tdms",)),
}


def _claim(file: h5py.File, folder: Path) -> None:
    attributes = dict(file["entry/data/displacement"].attrs)
    del file["entry/data/displacement"]
    made = file.create_dataset("entry/data/displacement", (10**12,), "f8", chunks=(1024,))
    made.attrs.update(attributes)
    made[:1000] = 0.0


def _packed(file: h5py.File, folder: Path) -> None:
    del file["entry/data/displacement"]
    made = file.create_dataset(
        "entry/data/displacement", (2**31,), "f8", chunks=(2**22,), compression=9
    )
    for chunk in range(0, 2**25, 2**22):
        made[chunk : chunk + 2**22] = 0.0


def _external(file: h5py.File, folder: Path) -> None:
    with h5py.File(folder / "secret.h5", "w") as secret:
        secret["x"] = np.arange(3000.0)
    del file["entry/data/displacement"]
    file["entry/data/displacement"] = h5py.ExternalLink("secret.h5", "/x")


def _loop(file: h5py.File, folder: Path) -> None:
    del file["entry/data/displacement"]
    file["entry/data/displacement"] = h5py.SoftLink("/entry/data/other")
    file["entry/data/other"] = h5py.SoftLink("/entry/data/displacement")


def _group_loop(file: h5py.File, folder: Path) -> None:
    file["entry/data/inside"] = file["entry"]  # a hard link to what holds it


def _virtual(file: h5py.File, folder: Path) -> None:
    del file["entry/data/displacement"]
    layout = h5py.VirtualLayout(shape=(10**9,), dtype="f8")
    layout[:] = h5py.VirtualSource("other.h5", "x", shape=(10**9,))
    file["entry/data"].create_virtual_dataset("displacement", layout)


def _title(file: h5py.File, folder: Path) -> None:
    del file["entry/title"]
    file["entry/title"] = np.array(
        b"x" * 50 * MILLION, dtype=h5py.string_dtype("utf-8", 50 * MILLION)
    )


def _many_items(file: h5py.File, folder: Path) -> None:
    for i in range(5_000):
        file[f"entry/instrument/i{i}"] = float(i)


def _sequence(file: h5py.File, folder: Path) -> None:
    for name in ("entry/sequence/data", "entry/sequence"):
        if isinstance(file.get(name), h5py.Dataset):
            text = (HEAD + "[[a]]\n" * 200_000).encode()
            del file[name]
            file[name] = np.array(text, dtype=h5py.string_dtype("utf-8", len(text)))
            return


RECORDINGS = {
    "dataset of 1e12 claimed samples": Case(_recording(_claim), ("claims",)),
    "dataset that unpacks to 16 GB": Case(_recording(_packed), ("claims",)),
    "link to another file": Case(_recording(_external), ("links are not followed",)),
    "links in a circle": Case(_recording(_loop), ("links are not followed",)),
    "group that holds itself": Case(_recording(_group_loop), code=None),
    "values of another file": Case(_recording(_virtual), ("other files",)),
    "title of 50 MB": Case(_recording(_title), code=None),
    "instruments by the thousand": Case(_recording(_many_items), code=None),
    "checked, instruments by the thousand": Case(
        _recording(_many_items, "info", "--verify"), code=None
    ),
    "checked, 1e12 claimed samples": Case(_recording(_claim, "info", "--verify"), code=None),
    "sequence of 200,000 tables": Case(_recording(_sequence), code=None),
    "replay of a sequence of 200,000 tables": Case(
        lambda folder: [
            "record", "--like", _recording(_sequence)(folder)[1], "--rig", "sim",
            "--out", str(folder / "out.h5"),
        ],
    ),
}  # fmt: skip

CASES = {**SEQUENCES, **RIG_FILES, **MODELS, **IMPORTS, **RECORDINGS}


def _fifo(folder: Path) -> Path:
    os.mkfifo(folder / "it")
    return folder / "it"


def _socket(folder: Path) -> Path:
    # bound by a short name: the path of a socket is at most 107 bytes
    before = Path.cwd()
    os.chdir(folder)
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind("it")
    finally:
        os.chdir(before)
    return folder / "it"


def _folder(folder: Path) -> Path:
    (folder / "it").mkdir()
    return folder / "it"


def _link_to_fifo(folder: Path) -> Path:
    os.mkfifo(folder / "pipe")
    (folder / "it").symlink_to(folder / "pipe")
    return folder / "it"


def _loop_of_links(folder: Path) -> Path:
    (folder / "it").symlink_to(folder / "that")
    (folder / "that").symlink_to(folder / "it")
    return folder / "it"


#: What is given in place of a file: it must be refused at once, and never block.
SPECIAL_FILES: dict[str, Callable[[Path], Path]] = {
    "pipe": _fifo,
    "socket": _socket,
    "folder": _folder,
    "device without end": lambda _: Path("/dev/zero"),
    "empty device": lambda _: Path("/dev/null"),
    "terminal": lambda _: Path("/dev/tty"),
    "link to a pipe": _link_to_fifo,
    "links in a circle": _loop_of_links,
    "name with a zero byte": lambda folder: folder / "a\0b",
    "name of 100,000 characters": lambda folder: folder / ("x" * 100_000),
    "missing file": lambda folder: folder / "nothing",
}

#: Every argument that names a file to read: ``{it}`` is the file, ``{out}`` a free name,
#: ``{run}``, ``{model}`` and ``{sequence}`` are good files.
INPUTS: dict[str, str] = {
    "sequence of record": "record {it} --rig sim --out {out}.h5",
    "like": "record --like {it} --rig sim --out {out}.h5",
    "rig file of record": "record thesis --rig sim --rig-file {it} --out {out}.h5",
    "rig file of check": "check --rig-file {it}",
    "import": "import {it} --out {out}.h5",
    "rig file of import": "import {run} --rig-file {it} --out {out}.h5",
    "info": "info {it}",
    "verify": "info --verify {it}",
    "export": "export {it} --to csv --out {out}.csv",
    "recover": "recover {it}",
    "identify": "identify {it} --out {out}.toml",
    "validation of identify": "identify {run} --validate {it} --out {out}.toml",
    "model of validate": "validate {it} {run}",
    "recording of validate": "validate {model} {it}",
    "diagnose": "diagnose {it} --validate {run}",
    "validation of diagnose": "diagnose {run} --validate {it}",
    "model of simulate": "simulate {it} --drive {sequence} --out {out}.csv",
    "drive of simulate": "simulate {model} --drive {it} --out {out}.csv",
    "rig file of gui": "gui --rig-file {it}",
}
