"""Many flights with known truth, the estimates made of them, and how wrong those are."""
