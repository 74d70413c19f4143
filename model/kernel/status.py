"""How a simulation can end, and how accurate it can be: the integers that the kernels return."""

from __future__ import annotations

__all__ = [
    "BAD_INPUT",
    "CAREFUL",
    "COARSE",
    "LOCKED",
    "NOT_CONVERGED",
    "NO_REST",
    "OK",
    "PULL_IN",
    "QUICK",
    "ROUGH",
]

OK = 0
PULL_IN = 1  #: the field outgrew the stiffness: the stretch ran away
LOCKED = 2  #: a spring reached its locking stretch
NOT_CONVERGED = 3  #: the step had to become too small
NO_REST = 4  #: no rest state under the load
BAD_INPUT = 5  #: not finite, or time that does not increase

# Fidelities, each with the error of the displacement on a film of 75 mm.
#: Some hundredths of a micrometre.
CAREFUL = 0
#: A tenth of a micrometre (some tenths on a step of 8 kV); as ``CAREFUL`` for hysteretic effects.
QUICK = 1
#: As ``QUICK``; of hysteretic effects a tenth of what they do, a little more while the film rings.
ROUGH = 2
#: As ``ROUGH``, in one step from sample to sample: for the drives of
#: ``dearig.model.fitting.coarse_drive``.
COARSE = 3
