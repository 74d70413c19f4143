"""Hidden effects by generator B: published forms that neither the model nor generator A has.

Each file holds one part of the signal path; each function draws one form of an effect of the
family that its ``TruthEffect`` names. ``dearig.sim_backend.truth.cases`` lists them. A diagnosis
that only knows generator A's forms is not tested by those: a rig of another make has others.
"""
