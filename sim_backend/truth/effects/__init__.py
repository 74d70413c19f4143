"""Hidden effects, a file each: functions that draw one effect, each in a form of its own.

To add one, add a file and list its function in ``dearig.sim_backend.truth.cases``. The ranges from
which sizes are drawn were set by measuring: under the thesis's excitation the thesis's film then
reads some 2 to 200 um RMS off, from what a diagnosis can just see in a noise of 1 um to what
dominates. Lags and slow changes start at 5 um, since all but a few per cent of them look like
other moduli.
"""
