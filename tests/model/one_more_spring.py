"""A strain energy is added by its file and a line in the list of names.

Run without compilation, with the folder of the file ``cubic.py``; prints what knows the law.
"""

from __future__ import annotations

import json
import sys
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import spec_from_file_location
from pathlib import Path

from dearig.model import spring_names

LAW = """
from dearig.model.compiled.jit import jit
from dearig.model.springs.description import ShapeParameter, SpringLaw

SPRING = SpringLaw(
    name="cubic", title="Cubic", summary="A cubic.", source="nobody",
    parameters=(ShapeParameter("bend", "b", (-1.0, 1.0), 0.0, "bend", typical=1e-2),),
    starts=lambda _: ((0.1,),),
)

@jit
def energy(strain, shape):
    return 0.5 * strain * (1.0 + shape[1] * strain)

@jit
def slope(strain, shape):
    return 0.5 + shape[1] * strain

@jit
def curvature(strain, shape):
    return shape[1]
"""


class Finder(PathFinder):
    """Finds the law in the folder of the test."""

    folder = Path()

    @classmethod
    def find_spec(cls, fullname: str, *_: object) -> ModuleSpec | None:
        if fullname != "dearig.model.springs.cubic":
            return None
        return spec_from_file_location(fullname, cls.folder / "cubic.py")


def main(folder: Path) -> None:
    (folder / "cubic.py").write_text(LAW, "utf-8")
    Finder.folder = folder
    sys.meta_path.insert(0, Finder)
    spring_names.SPRING_MODULES = (*spring_names.SPRING_MODULES, "cubic")
    spring_names.SPRINGS = (*spring_names.SPRINGS, "cubic")

    from typing import get_args

    from dearig.cli.options import SpringChoice, SpringKind
    from dearig.config.modelfile import load_model, save_model
    from dearig.model import springs
    from dearig.model.film.material import Network, Spring
    from dearig.model.simulation.strip import Strip

    spring = Spring(1e4, kind="cubic", shape=(0.25,))
    save_model(folder / "m.toml", "m", Strip(Network(spring)), {})
    code, shape = springs.SPRINGS.index("cubic"), (float("inf"), 0.25, 0.0, 0.0)
    told = {
        "options": "cubic" in get_args(SpringKind) and "cubic" in get_args(SpringChoice),
        "read": load_model(folder / "m.toml").model.network.equilibrium == spring,
        "shown": springs.SPRING_LAWS["cubic"].shown,
        "kernel": [
            getattr(springs, name)(code, 2.0, shape)
            for name in ("energy", "slope", "curvature", "principal_pull")
        ],
        "locking": springs.locking_strain(code, shape) == float("inf"),
        "principal": springs.has_principal(code),
    }
    print(json.dumps(told))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
