"""Which of two gaits of one request is the better one, on either grid."""

from dataclasses import replace

from walk_optimizer.gait import Gait, RefinedGait

# Two solves of one optimum differ by less, relative to F; two refinements of it by what their meshes do.
_REPEATED, _REFINED_AGAIN = 1e-8, 1e-6


def best_of_both(former: Gait, gait: Gait) -> Gait:
    """Return what is better of two gaits of one request on either grid; `former` itself if all of it is."""
    best = gait if gait.objective < former.objective * (1 - _REPEATED) else former
    refined = gait.refined if refines_better(gait.refined, former.refined) else former.refined
    return best if best.refined is refined else replace(best, refined=refined)


def refines_better(refined: RefinedGait | None, former: RefinedGait | None) -> bool:
    """Return whether a refinement takes less torque than another one; any is better than none."""
    if refined is None or former is None:
        return refined is not None
    effort, known = (one.trajectory.torque_effort for one in (refined, former))
    return effort < known * (1 - _REFINED_AGAIN)
