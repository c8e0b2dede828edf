"""What a map of the world cannot be made from is refused in one line."""

from dataclasses import replace

import numpy as np
import pytest

from citypv.core.energy.pv_system import dc_system
from citypv.core.settings.errors import InputError
from citypv.core.sun.horizon import STEPS, TerrainHorizon
from citypv.core.sun.sky_grid import sky_grid_suns
from citypv.core.sun.sun_sampling import choose_suns
from citypv.core.sun.suns import interrupted_suns
from citypv.core.world.environment import build_environment

from .transfers import Horizons
from .weathers import HOUR, year_of


def test_other_suns_than_a_sky_grid_are_refused_with_what_to_run():
    system = dc_system()
    whole, flat = (Horizons(9).transfer(sky_grid_suns(16)) for _ in range(2))
    flat.surfaces.eligible[:] = False
    days = Horizons(9).transfer(choose_suns("days:2", year_of(), HOUR, 52.5, 13.4))
    part = Horizons(9).transfer(replace(interrupted_suns(sky_grid_suns(100), 40), sampling="sky-grid:100"))
    for transfer, words in (
        (days, r"days:2, which holds for one latitude only; .*--suns sky-grid"),
        (part, "40 directions"),
        (replace(whole, terrain=TerrainHorizon(np.full(STEPS, 5.0))), "again without --horizon"),
        (replace(whole, bare=whole, leaf_months=(5, 6)), "--leaf-months all"),
        (flat, "no eligible"),
    ):
        with pytest.raises(InputError, match=words):
            build_environment("town", "transfer.nc", transfer, system)
    with pytest.raises(InputError, match="--sky isotropic"):
        build_environment("town", "transfer.nc", whole, system, "perez")
