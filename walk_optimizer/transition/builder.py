"""Solves the transitions that ship with the package, and recomputes certificates of solved ones."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

from walk_optimizer.gait import Certificate, Gait
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.transition.certificate import certify_steps
from walk_optimizer.transition.paces import Pace
from walk_optimizer.transition.solve import plan_transition
from walk_optimizer.transition.standing import Standing
from walk_optimizer.transition.table import TransitionTable
from walk_optimizer.transition.transition import Transition, TransitionOutcome


def table_pairs(stand: Standing, gaits: Sequence[Gait]) -> list[tuple[Pace, Pace]]:
    """Return which paces the packaged transitions join.

    From the stand into every gait and back, and of each spring mode from every speed to the next ones. Gaits
    that are not refined have none.

    Args:
        stand: Where walks begin and end.
        gaits: Of the table, one of a speed and mode.
    """
    pairs: list[tuple[Pace, Pace]] = []
    refined = sorted((g for g in gaits if g.refined is not None), key=lambda gait: gait.request.speed)
    for mode in SpringMode:
        own = [gait for gait in refined if gait.request.spring_mode is mode]
        for gait in own:
            pairs += [(stand, gait), (gait, stand)]
        for slower, faster in pairwise(own):
            pairs += [(slower, faster), (faster, slower)]
    return pairs


def build_table(
    table: TransitionTable, pairs: Sequence[tuple[Pace, Pace]]
) -> Iterator[tuple[Pace, Pace, TransitionOutcome]]:
    """Solve and store the transitions that a table lacks, one after the other.

    Yields:
        Each pair that was solved for, with what that led to.
    """
    for source, target in pairs:
        if table.find(source, target) is None:
            outcome = plan_transition(table.walker, source, target)
            if outcome.transition is not None:
                table.store(outcome.transition)
            yield source, target, outcome


def recomputed(transition: Transition) -> Certificate:
    """Return the certificate of a transition, whatever it says about itself."""
    _, certificate = certify_steps(
        transition.walker, transition.source, transition.target, transition.steps, transition.torque_limit
    )
    return certificate
