"""The sun path of the report against spherical trigonometry."""

import numpy as np
import pandas as pd
import pytest

from citypv.core.results.draw_sun_path import day_path, hour_curves


@pytest.mark.parametrize(("latitude", "longitude"), [(52.5, 13.4), (-33.9, 151.2), (1.3, 103.8)])
def test_the_sun_stands_where_spherical_trigonometry_says(latitude, longitude):
    """Highest at noon with 90° − |latitude − declination|; ±23.44° at the solstices, to the day and refraction."""
    for month, declination in ((6, 23.44), (12, -23.44), (3, 0.0)):
        azimuth, elevation = day_path(2021, month, 21, latitude, longitude)
        top = np.nanargmax(elevation)
        assert elevation[top] == pytest.approx(90 - abs(latitude - declination), abs=0.5)
        if abs(latitude - declination) > 5:
            south = latitude > declination
            assert np.cos(np.radians(azimuth[top])) == pytest.approx(-1 if south else 1, abs=0.01)
    times = pd.date_range("2021-01-01", periods=8760, freq="h", tz="UTC")
    curves = hour_curves(times, pd.Timedelta(hours=1), latitude, longitude)
    assert set(curves) <= {f"{hour:02d}:30" for hour in range(24)}
    noon = f"{int((12 - longitude / 15) % 24):02d}:30"
    assert max(np.nanmax(elevation) for _, elevation in curves.values()) == pytest.approx(
        np.nanmax(curves[noon][1]), abs=2.5
    )
