"""The ends of a motion that begins in a given state, and ends in any within its bounds."""

import casadi as ca

from walk_optimizer.transcription.boundary import end_functions


def free_end_functions(name: str, symbols: ca.SX, width: int) -> list[ca.Function]:
    """Return the functions of such ends; the start, scaled, is the ends' own numbers.

    Args:
        name: Prefix of their names.
        symbols: The model's vector.
        width: Number of entries of a state.
    """
    start = ca.SX.sym("start", width)
    return end_functions(name, ca.SX.sym("z", width), ca.vertcat(symbols, start), start)
