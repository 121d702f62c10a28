"""What the estimators know of physics: pure functions, each with its source."""
