"""City: from files to a classified scene in Blender.

In: building files, the settings of the panel, materials of faces.
Out: objects with face attributes, a Session with City and Scene, a Request.
Read first: `import_city`.
"""
