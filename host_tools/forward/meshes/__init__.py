"""A scene to a mesh: the half plane of an axisymmetric scene, one topology for the training box, or the whole body.

Modules in reading order: `sketch`, `mesh`, `morph`, `solid_mesh`.

Geometry only: no material law, no contact.
"""
