"""How a simulated step ends: by landing, or by what counts as a fall."""

from enum import StrEnum


class Ending(StrEnum):
    """How a step ended."""

    LANDED = "landed"
    STUMBLED = "stumbled"
    HIP_TOO_LOW = "hip_too_low"
    LIFTED = "lifted"
    SLIPPED = "slipped"
    NO_TOUCH_DOWN = "no_touch_down"
    BAD_LANDING = "bad_landing"
    TOO_FAST = "too_fast"

    @property
    def is_fall(self) -> bool:
        """Whether the walk is over."""
        return self is not Ending.LANDED

    @property
    def sentence(self) -> str:
        """The ending in words."""
        return _SENTENCES[self]


_SENTENCES = {
    Ending.LANDED: "the swing foot landed",
    Ending.STUMBLED: "the swing foot hit the ground before it was far enough ahead",
    Ending.HIP_TOO_LOW: "the hip sank too low",
    Ending.LIFTED: "the stance foot lost the ground, which would have had to pull",
    Ending.SLIPPED: "the stance foot slipped, its force left the friction cone",
    Ending.NO_TOUCH_DOWN: "the swing foot did not come down in time",
    Ending.BAD_LANDING: "the landing foot slipped, or the ground would have had to pull",
    Ending.TOO_FAST: "a joint turned faster than any walk",
}
