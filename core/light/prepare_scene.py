"""What tracing a scene needs before the first ray, made once per run: materials, patches, the plan
of effects.
"""

from dataclasses import dataclass, replace

from ..city.scene import Scene
from ..effects.effect import TracePlan
from ..effects.plan_effects import plan_effects
from ..modules.lay_city import LayoutRules
from ..patches.facing_scene import FacingScene
from ..patches.patches import Patches
from ..patches.read_albedo import albedo_of_triangles, name_brdfs
from ..settings.progress import silent
from ..settings.threads import usable_threads
from ..sun.suns import Suns


@dataclass
class PreparedScene:
    """A scene that can be traced."""

    scene: Scene  # with the backs of sheets
    materials: list  # of patches.read_albedo.Found: each surface and, last, the generated ground
    patches: Patches
    plan: TracePlan
    suns: Suns | None = None  # if they were chosen already
    bounces: int | None = None  # number of reflections, where a run before found it
    rounds: bool = False  # whether what rays met is kept, for further rounds
    editable: bool = False  # whether what rays and suns met is kept, for edits of the city
    # how modules are laid out, for what strings of them lose in shade; None: that stays unknown
    rules: LayoutRules | None = None

    @property
    def canopy(self):
        """What attenuates rays: Canopy, or None without trees."""
        return self.plan.foliage and self.plan.foliage.canopy

    @property
    def states(self):
        """States of trees: in leaf and bare where some lose their leaves, else one."""
        return self.canopy.states if self.canopy else 1

    def build_tree(self, request):
        """Build the tree of the triangles, for several rounds, and its crowns as planned:
        PreparedScene.
        """
        threads = usable_threads(request.threads)
        ray_scene = self.plan.ray_scene or FacingScene(self.scene, self.patches, threads)
        ray_scene.canopy = self.canopy
        return replace(self, plan=replace(self.plan, ray_scene=ray_scene))

    def reseed(self, seed):
        """Exchange the random numbers for those that another seed gives: PreparedScene."""
        return replace(self, patches=self.patches.reseed(self.scene, seed))


def check_tracing(scene, suns, request):
    """Refuse what cannot be traced.

    Raises
    ------
    InputError
        A number, an array or a setting is invalid.
    """
    scene.check()
    suns.check()
    request.check()


def prepare_scene(scene, request, *, weather=None, suns=None, materials=None, progress=silent):
    """Materials, patches and plan of a scene.

    Parameters
    ----------
    scene : Scene
    request : Request
    weather : Weather, optional
    suns : Suns, optional
        Where they are known already, for effects that depend on them.
    materials : list, optional
        As of `PreparedScene`, where they are known already.
    progress : callable, optional
        As of `plan_effects`.

    Returns
    -------
    PreparedScene

    Raises
    ------
    InputError
        The scene, the albedo file, a material or an effect cannot be used.
    """
    scene.check()
    materials = name_brdfs(scene, request) if materials is None else materials
    scene = replace(scene.with_backs(), ground_albedo=request.ground_albedo)
    patches = Patches.of_scene(scene, albedo_of_triangles(scene, request, materials), request.seed)
    plan = plan_effects(
        scene, patches, request, materials=materials, weather=weather, suns=suns, progress=progress
    )
    return PreparedScene(scene, materials, patches, plan, suns)
