"""Plants for closed loops, run by MuJoCo: programs for `sinew compare --plant-program` and `sinew simulate --plant-program`."""
