"""One page for the anomaly board: verdict first, then its evidence."""
