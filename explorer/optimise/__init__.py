"""Optimal design by SQP: problems, what they demand, and the solver (the paper's section 6).

A `Problem` has variables, an objective and demands; `optimise_design` searches for the best design
and returns an `Outcome` with its status.
"""
