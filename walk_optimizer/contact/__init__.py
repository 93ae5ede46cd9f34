"""Contact of the feet with the ground: complementarity pairs, schedules and impact."""
