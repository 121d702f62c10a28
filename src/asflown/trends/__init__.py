"""The health of an actuator over years: actuations, figures of merit, their store and verdicts."""
