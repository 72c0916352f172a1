"""Optimal design by SQP: problems, what they demand, and the solver (the paper's section 6).

A `Problem` says what may change, what is wanted and what must hold; `optimise_design`
looks for the best design and returns an `Outcome` that says how far it got.
"""
