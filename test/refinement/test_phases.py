"""What the refined grid takes from a contact schedule."""

import numpy as np

from walk_optimizer.contact.schedule import FootMode, double_impact, single_impact
from walk_optimizer.transcription.phases import phases_of

FREE, STICK = FootMode.FREE, FootMode.STICK


def test_plain_walking_is_one_phase_with_one_landing_foot() -> None:
    (phase,) = phases_of(single_impact(50))
    assert phase.modes == (STICK, FREE)
    assert phase.impact == (STICK, FREE)
    assert phase.landing == (True, False)


def test_an_instant_of_double_support_becomes_part_of_the_impact() -> None:
    (phase,) = phases_of(double_impact(50))
    assert phase.impact == (STICK, STICK)
    assert phase.landing == (True, False)


def test_what_ends_the_step_belongs_to_the_next_impact() -> None:
    schedule = single_impact(50)
    schedule[1, -1] = STICK
    (phase,) = phases_of(schedule)
    assert phase.impact == (STICK, STICK)


def test_double_support_that_lasts_is_a_phase() -> None:
    schedule = single_impact(50)
    schedule[1, :10] = STICK
    first, second = phases_of(schedule)
    assert (first.modes, second.modes) == ((STICK, STICK), (STICK, FREE))
    assert second.start == 10 / 50
    assert not second.begins_with_impact


def test_a_foot_that_slips_as_the_step_ends_takes_no_impulse() -> None:
    schedule = single_impact(50)
    schedule[0, 20:30] = FootMode.SLIP_FORWARD
    schedule[0, -1] = FootMode.SLIP_BACKWARD
    phases = phases_of(schedule)
    assert [phase.modes[0] for phase in phases] == [STICK, FootMode.SLIP_FORWARD, STICK]
    assert phases[0].impact == (STICK, FREE)
    assert not any(phase.begins_with_impact for phase in phases[1:])


def test_flight_ends_with_an_impact() -> None:
    schedule = single_impact(50)
    schedule[0, 20:30] = FREE
    phases = phases_of(schedule)
    assert [phase.modes[0] for phase in phases] == [STICK, FREE, STICK]
    assert [phase.begins_with_impact for phase in phases] == [True, False, True]
    assert np.isclose(phases[2].start, 30 / 50)
