"""Writes serialized meshes by the description of the format in Mitsuba's documentation."""
import struct, zlib
def mesh(version, flags, name, positions, normals, uvs, colours, triangles, double):
    f = "d" if double else "f"
    data = struct.pack("<I", flags)
    if version == 4: data += name.encode() + b"\0"
    data += struct.pack("<QQ", len(positions), len(triangles))
    for values in (positions, normals, uvs, colours):
        for v in values or []: data += struct.pack("<%d%s" % (len(v), f), *v)
    for t in triangles: data += struct.pack("<3I", *t)
    return struct.pack("<HH", 0x041c, version) + zlib.compress(data)
def write(path, version, meshes):
    data, offsets = b"", []
    for m in meshes: offsets.append(len(data)); data += m
    for o in offsets: data += struct.pack("<I" if version == 3 else "<Q", o)
    open(path, "wb").write(data + struct.pack("<I", len(meshes)))
corners = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (1, 2, 0.5)]
uvs = [(0, 0), (1, 0), (0, 1), (1, 1)]
up = [(0, 0, 1)] * 4
colours = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.5, 0.5, 0.5)]
def two(version):
    single = mesh(version, 0x1002, "one", corners[:3], None, uvs[:3], None, [(0, 1, 2)], False)
    double = mesh(version, 0x2001 | 0x2 | 0x8, "two", corners, up, uvs, colours, [(0, 1, 2), (1, 3, 2)], True)
    return [single, double]
for version in (3, 4): write("meshes%d.serialized" % version, version, two(version))
