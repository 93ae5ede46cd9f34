"""New speeds in milliseconds: single support condensed to angular velocities, by an interior-point method."""
