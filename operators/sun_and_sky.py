"""A sun lamp and a sky that match a moment of the timeline; the user's own lamps and world stay as they are."""

import bpy
from mathutils import Vector

from .attributes import PREFIX
from .build_meshes import show_objects

SUN, SKY = "CityPV sun", "CityPV timeline sky"
STRENGTH = 0.005  # of the lamp, per Wm⁻²: 5 at full sun suits Blender's view transforms
BRIGHTNESS = 0.004  # of the sky, per Wm⁻² of DHI
ANGLE = 0.0093  # of the sun's disc [rad]


def light_scene(stage, direction, dni, dhi):
    """Set lamp and sky.

    Parameters
    ----------
    stage : bpy.types.Scene
    direction : (3,) float
        Towards the sun.
    dni, dhi : float [Wm⁻²]
    """
    up = direction[2] > 0
    lamp = bpy.data.objects.get(SUN) or _add_lamp(stage)
    lamp.rotation_euler = Vector([float(part) for part in direction]).to_track_quat("Z", "Y").to_euler()
    lamp.data.energy = STRENGTH * dni if up else 0.0
    world = bpy.data.worlds.get(SKY) or _add_sky()
    texture, background = (world.node_tree.nodes[name] for name in ("Sky Texture", "Background"))
    texture.sun_direction = [float(direction[0]), float(direction[1]), max(float(direction[2]), 0.0)]
    background.inputs["Strength"].default_value = BRIGHTNESS * dhi if up else 0.0
    if stage.world != world:
        stage.world = world


def remove_light():
    """Remove lamp and sky."""
    lamp, world = bpy.data.objects.get(SUN), bpy.data.worlds.get(SKY)
    if lamp is not None:
        data = lamp.data
        bpy.data.objects.remove(lamp)
        bpy.data.lights.remove(data)
    if world is not None:
        bpy.data.worlds.remove(world)


def _add_lamp(stage):
    light = bpy.data.lights.new(SUN, "SUN")
    light.angle = ANGLE
    lamp = bpy.data.objects.new(SUN, light)
    lamp[PREFIX + "part"] = "sun"
    show_objects(stage, lamp)
    return lamp


def _add_sky():
    world = bpy.data.worlds.new(SKY)
    if world.node_tree is None:
        world.use_nodes = True
    nodes = world.node_tree.nodes
    nodes.clear()
    texture, background = nodes.new("ShaderNodeTexSky"), nodes.new("ShaderNodeBackground")
    output = nodes.new("ShaderNodeOutputWorld")
    texture.name, background.name = "Sky Texture", "Background"
    texture.sky_type = "HOSEK_WILKIE"  # the same in all versions of Blender
    world.node_tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    world.node_tree.links.new(background.outputs["Background"], output.inputs["Surface"])
    return world
