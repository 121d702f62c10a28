"""One page for the anomaly board: verdict first, then what it rests on."""
