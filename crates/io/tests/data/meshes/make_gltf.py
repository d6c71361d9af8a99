"""Writes two_boxes.glb, two_boxes.gltf and two_boxes.bin with trimesh 4 (pip install trimesh).

A box of sides 1, 2, 3 around the origin with a colour for each vertex, and a second node that shows the same box,
mirrored in x, scaled by a half and moved by (5, 0, 0). In the text form the buffers are in one file.
"""

import json
import struct

import numpy
import trimesh

box = trimesh.creation.box(extents=(1, 2, 3))
colours = numpy.array([[255, 0, 51, 255]] * 4 + [[0, 102, 255, 255]] * 4, numpy.uint8)
box.visual = trimesh.visual.ColorVisuals(box, vertex_colors=colours)
scene = trimesh.Scene()
scene.add_geometry(box, node_name="first", geom_name="box")
place = numpy.diag([-0.5, 0.5, 0.5, 1.0])
place[0, 3] = 5.0
scene.graph.update(frame_to="second", matrix=place, geometry="box")
glb = scene.export(file_type="glb")
open("two_boxes.glb", "wb").write(glb)

# The same as text: the two chunks of the binary form, each to its file.
length = struct.unpack("<I", glb[12:16])[0]
document = json.loads(glb[20 : 20 + length])
data = glb[20 + length + 8 :]
document["buffers"][0]["uri"] = "two_boxes.bin"
json.dump(document, open("two_boxes.gltf", "w"), indent=1)
open("two_boxes.bin", "wb").write(data)
print(box.vertices, box.faces, json.dumps(document, indent=1)[:3000])
