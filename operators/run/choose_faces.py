"""Which faces pay: take the modules off faces with too few hours as soon as the panel asks for
others, and show the map of what stays.

Light and hours are known; only sums change.
"""

from dataclasses import replace

from ..city.attributes import Faces
from ..city.declare_settings import read_properties
from ..city.read_settings import remember_choice
from ..city.session import Session, find_city
from ..show.show_result import show_result
from .compare_results import compare_with_before
from .summarise import sum_energy, summarise_energy


def follow_least_hours(settings, context):
    """Choose anew when *Least hours* changes (`update` of the property), where there is energy."""
    city, ground = find_city(context.scene)
    if not renew_choice(city, settings):
        return
    session = Session.of(city)
    Faces(city, ground).write_results(session.transfer, session.energy)
    told = sum_energy(session.transfer, session.weather, session.energy, session.request)
    summarise_energy(city, session.weather, session.energy, **told)
    remember_choice(city, settings, "least_hours")
    compare_with_before(context.scene, city, ground)
    show_result(context, city, ground, "module_hours")


def renew_choice(city, settings):
    """Choose the modules of a city's session by the panel's least hours: whether it had others.

    Undo takes back what stands in the file, but not the session.
    """
    session = Session.of(city)
    if session is None or session.energy is None or session.request is None:
        return False
    from ...core.energy.paying import choose_modules
    from ...core.energy.pv_system import build_system

    least = read_properties(settings)["least_hours"]
    if least == session.request.least_hours:
        return False
    session.request = request = replace(session.request, least_hours=least)
    timed, before = session.timeline, session.energy
    session.energy = choose_modules(before, session.transfer.surfaces, build_system(request))
    if timed is not None and timed[0] is before:
        session.timeline = session.energy, timed[1]
    return True
