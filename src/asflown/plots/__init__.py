"""Results onto axes: functions that take axes and return them, and never touch a global figure."""
