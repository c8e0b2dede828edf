"""Weighted means of environments: a region described by a set of them (paper, sections 2 and 4)."""

from dataclasses import replace

import numpy as np

from ..settings.errors import InputError

OPTION = "--mix"
NAME = "mix"
EXACT = 1e-6


def parse_mix(text, names):
    """Weights of environments from "berlin=0.6,manhattan=0.4".

    Parameters
    ----------
    text : str
    names : list of str
        Environments that are there.

    Returns
    -------
    dict of str to float

    Raises
    ------
    InputError
        If a name is unknown, twice, or that of the mix, a weight is no number above 0, or they do not add up to 1.
    """
    if NAME in names:
        raise InputError(OPTION, f"an environment is called {NAME!r}", "give it another name: NAME=transfer.nc")
    weights = {}
    for part in filter(None, text.split(",")):
        name, _, number = (piece.strip() for piece in part.partition("="))
        if name not in names:
            raise InputError(OPTION, f"no environment is called {name!r}", f"give some of {', '.join(names)}")
        if name in weights:
            raise InputError(OPTION, f"{name!r} is there twice", "give each environment one weight")
        try:
            weights[name] = float(number)
        except ValueError:
            raise InputError(OPTION, f"{part!r} is not NAME=WEIGHT", "give numbers above 0") from None
        if not 0 < weights[name] <= 1:
            raise InputError(OPTION, f"the weight {number} of {name} is not above 0 and at most 1", "give shares of 1")
    if abs(sum(weights.values()) - 1.0) > EXACT:
        raise InputError(OPTION, f"the weights add up to {sum(weights.values()):g}", "let them add up to 1")
    return weights


def add_mix(world, weights):
    """A world with the weighted mean of some environments as a further one, called "mix".

    Parameters
    ----------
    world : World
    weights : dict of str to float
        Of `parse_mix`.

    Returns
    -------
    World
        A group that one of the environments lacks is missing in the mix.
    """
    members = [world.environments.index(name) for name in weights]
    share = np.array(list(weights.values()))

    def mean(values):
        return np.concatenate([values, np.einsum("e,pe...->p...", share, values[:, members])[:, None]], axis=1)

    whole = (world.group_count[members] > 0).all(axis=0)
    return replace(
        world,
        environments=[*world.environments, NAME],
        sources=[*world.sources, ", ".join(f"{weight:g} {name}" for name, weight in weights.items())],
        group_count=np.concatenate([world.group_count, [world.group_count[members].sum(axis=0) * whole]]),
        group_area=np.concatenate([world.group_area, [world.group_area[members].sum(axis=0) * whole]]),
        full_load_hours=mean(world.full_load_hours).astype(np.float32),
        standard_error=join_errors(world.standard_error, share, members),
        gain_error=join_gains(world, share, members),
        without_reflections=mean(world.without_reflections).astype(np.float32),
    )


def join_errors(values, share, members):
    """Standard errors, with that of a mix of environments whose errors are independent: (p, e + 1, g, …)."""
    mix = np.sqrt(np.einsum("e,pe...->p...", share**2, values[:, members].astype(float) ** 2))
    return np.concatenate([values, mix[:, None].astype(np.float32)], axis=1)


def join_gains(world, share, members):
    """Standard errors of the gain by reflections, with that of a mix: (p, e + 1, g)."""
    plain = world.without_reflections[..., 0].astype(float)
    whole = np.einsum("e,peg->pg", share, plain[:, members])
    hours = join_errors(world.gain_error * plain, share, members)[:, -1]
    mix = np.divide(hours, whole, out=np.full_like(whole, np.nan), where=whole > 0)
    return np.concatenate([world.gain_error, mix[:, None].astype(np.float32)], axis=1)
