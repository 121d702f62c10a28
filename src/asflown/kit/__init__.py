"""What every room stands on: errors, units at the border, time, rotations, local regression."""
