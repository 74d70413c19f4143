"""Names of the strain energies; a list of options reads them without the compiled laws."""

from __future__ import annotations

__all__ = ["SPRINGS", "SPRING_MODULES"]

#: Modules in ``dearig.model.springs``, a line each, in the order of the integer codes that the
#: kernels use. The first two are integrated in closed form (``kernel.exponential_rk``).
SPRING_MODULES = (
    "neo_hookean",
    "gent",
    "arruda_boyce",
    "yeoh",
    "mooney_rivlin",
    "ogden",
    "ogden_two_terms",
    "extended_tube",
)
#: Names in model files, in the order of the codes.
SPRINGS = tuple(name.replace("_", "-") for name in SPRING_MODULES)
