"""Hidden effects, one file each; each function draws one form of the effect.

To add one, add a file and list its function in ``dearig.sim_backend.truth.cases``. The ranges of
sizes come from measurement: under the thesis's excitation they change the reading of the thesis's
film by some 2 to 200 um RMS, from just detectable in a noise of 1 um to dominant. Lags and slow
changes start at 5 um, since changed moduli can absorb all but a few per cent of them.
"""
