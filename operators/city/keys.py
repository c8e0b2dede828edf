"""Names of all that CityPV writes into a .blend beside faces: custom properties of objects, scenes,
materials and collections.
"""

from .attributes import PREFIX


class Key:
    """A custom property, by its name."""

    # Of every object that CityPV makes: "city", "ground", "before", "legend", "sun", "picture".
    PART = PREFIX + "part"
    # Of a city: where its local origin stands, how far true north is turned, its ground.
    ORIGIN, CONVERGENCE, GROUND = PREFIX + "origin", PREFIX + "convergence", PREFIX + "ground"
    BUILDINGS = PREFIX + "buildings"  # names of its buildings, in file order
    TURN = PREFIX + "turn"  # of what holds cities, of `renew_holders`
    SESSION = PREFIX + "session"  # which session of this Blender knows it
    ASKED = PREFIX + "asked_"  # + step: the settings that it was done with
    MATERIAL = PREFIX + "material"  # of a material: the user's choice

    # Light of a city: the file that it is kept in, relative to the .blend; where it was looked for,
    # and why it could not be read; settings of its plan and what they were predicted to cost.
    TRANSFER_FILE, TRANSFER_FOLDER = PREFIX + "transfer_file", PREFIX + "transfer_folder"
    TRANSFER_PROBLEM = PREFIX + "transfer_problem"
    PLANNED = PREFIX + "planned"  # effect -> state, sentence
    PREDICTED = PREFIX + "predicted"  # preset -> seconds, error [%]

    # Of a city that is made of the user's objects, or has some added.
    TAKEN = PREFIX + "taken"  # number -> object of the user
    TAKEN_BUILDINGS = PREFIX + "taken_buildings"  # building of each; "" if it shows no own faces
    TAKEN_FROM = PREFIX + "taken_from"  # the collection that they were in, where one was chosen
    WEARERS = PREFIX + "wearers"  # objects that were added to a city of files
    SEEN = PREFIX + "seen"  # whether the city is the one to be seen
    METRES = PREFIX + "metres"  # of one unit of Blender's scene
    IDENTITY, OWNER = PREFIX + "id", PREFIX + "of"  # of a city; of an object added to it: the same
    AGAINST = PREFIX + "against"  # the variant that it is compared with
    BESIDE, ADDED = PREFIX + "beside", PREFIX + "added"  # objects beside it, what came since: words
    POLYGONS = PREFIX + "polygons"  # of an object: ids of the polygons that it was made of

    # Of a city that can be edited.
    LINEAGE = PREFIX + "lineage"  # names the polygons of the files, and edits of its own mesh
    REMOVED = PREFIX + "removed"  # ids of buildings of the files that are left out, one per line
    SHAPE, EDITED = PREFIX + "shape", PREFIX + "edited"  # digest of its mesh; whether it is another
    GROUND_SHAPE, GROUND_EDITED = PREFIX + "ground_shape", PREFIX + "ground_edited"  # likewise
    DESIGN, REDESIGNED = PREFIX + "design", PREFIX + "redesigned"  # of all else, likewise
    FAMILY, VARIANT = PREFIX + "family", PREFIX + "variant"  # of all variants; what this is called
    PREVIEW = PREFIX + "preview"  # of an edit that is not computed to its end, as text
    # Of an object of the user: hidden with its variant, the building that it is where not called
    # so, and the digest of the shape in which it was made of a building of the files.
    PUT_AWAY, BUILDING_ID = PREFIX + "put_away", PREFIX + "building_id"
    ORIGINAL = PREFIX + "original"

    # Numbers of the panel: tables as JSON, by groups and in all.
    GROUPS, WEATHER, WEATHER_PLACE = PREFIX + "groups", PREFIX + "weather", PREFIX + "weather_place"
    TOTALS, ENERGY_TOTALS = PREFIX + "totals", PREFIX + "energy_totals"  # the latter [MWh per year]
    ALBEDOS, UNREAD = PREFIX + "albedos", PREFIX + "unread"
    INTERRUPTED = PREFIX + "interrupted"  # which suns were traced, in words
    KWP = PREFIX + "kwp"  # of each surface
    FEW = PREFIX + "few"  # surfaces that too few hours take their modules from
    COMPARED, MATCHED = PREFIX + "compared", PREFIX + "matched"  # before and after; a sentence
    TOLD = PREFIX + "told"  # buildings that files tell something about: id, address, name
    # buildings: id, power [kWp], energy [MWh per year], P50 and P90 of years
    BEST = PREFIX + "best"
    FILES, REPORT, REPORT_ROWS = PREFIX + "files", PREFIX + "report", PREFIX + "report_rows"
    PROBE, CHARTS = PREFIX + "probe", PREFIX + "charts"  # of the face that was asked for

    # What is drawn of a city.
    KIND, DIFFUSE_RELATIVE = PREFIX + "kind", PREFIX + "diffuse_relative"  # attributes of faces
    COLOUR = PREFIX + "colour"  # the colour attribute
    COLOUR_ATTRIBUTE, COLOUR_MAP = PREFIX + "colour_attribute", PREFIX + "colour_map"
    COLOUR_LOW, COLOUR_HIGH = PREFIX + "colour_low", PREFIX + "colour_high"
    RANGE = PREFIX + "range_"  # + attribute: ends that the user chose
    WORN = PREFIX + "worn"  # its colours are shown on the user's objects
    ACTIVE_COLOUR = PREFIX + "active_colour"  # of a mesh: the attribute that the user had chosen
    # of an object with a coloured copy
    DRAWN_AS, LEFT_OUT = (
        PREFIX + "drawn_as",
        PREFIX + "left_out",
    )
    STAND_INS = PREFIX + "stand_ins"  # what the panel says of objects without faces of their own
    HIGHLIGHT = PREFIX + "highlight"  # of an object: its selected faces are drawn over
    MOMENT = PREFIX + "moment"  # of the timeline, as text
    # Of a scene: how it was drawn before colours were shown.
    SHADING_BEFORE = PREFIX + "shading_before"
    TRANSFORM_BEFORE = PREFIX + "transform_before"
