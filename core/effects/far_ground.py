"""`far-ground`: light from the open ground beyond the scene."""

from .effect import Effect

KEY = "far-ground"


def decide(inputs):
    """Unshaded ground is half of what a wall's lower hemisphere can see."""
    request = inputs.request
    bound = request.ground_albedo / 2
    if not inputs.asked(KEY, request.far_ground):
        return Effect(KEY, False, "none", "switched off: rays that leave downwards carry nothing", bound)
    if not inputs.decided["reflections"].on:
        return Effect(KEY, False, "none", "it only shines by reflection, and nothing is reflected", 0.0)
    return Effect(KEY, True, "once reflected", "rays that leave downwards meet unshaded ground", 0.0)
