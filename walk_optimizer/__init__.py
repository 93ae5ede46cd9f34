"""Energy-optimal walking gaits of a biped with knee springs, by direct collocation with contact."""

__version__ = "0.1.0"
