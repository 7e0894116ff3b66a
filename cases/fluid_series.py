# SPDX-License-Identifier: MIT
"""What several cases read off the time series of the fluid, fluid.csv."""

import numpy as np


def volume_drift(series):
    """Largest change over the run of the area (volume) inside the envelope over that of the points. At the
    start their ratio differs from one where the lattice meets an oblique edge."""
    unit = "m3" if "volume_m3" in series else "m2"
    ratio = series[f"volume_{unit}"] / series[f"point_volume_{unit}"]
    return float(np.abs(ratio / ratio[0] - 1).max())
