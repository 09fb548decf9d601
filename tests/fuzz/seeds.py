#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes the first files of corpus/: small valid inputs of every kind. They are committed, so this
runs only when a format changes: seeds.py (needs python3 and lcm-gen). Files that a fuzzer found
stay as they are; their names begin with "found-"."""
import base64
import gzip
import os
import struct
import subprocess
import sys
import tempfile
import zlib

HERE = os.path.dirname(os.path.abspath(__file__))
TYPES = os.path.join(HERE, "..", "..", "lcmtypes")


def put(corpus, name, data):
    folder = os.path.join(HERE, "corpus", corpus)
    os.makedirs(folder, exist_ok=True)
    if isinstance(data, str):
        data = data.encode()
    with open(os.path.join(folder, name), "wb") as file:
        file.write(data)


# --- meshes: a tetrahedron, and a square pyramid with a quad ---

POINTS = [(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
QUADS = [(0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]
BASE = [(0, 0, 0), (0.1, 0, 0), (0.1, 0.1, 0), (0, 0.1, 0), (0.05, 0.05, 0.1)]


PACKED = " compressor='vtkZLibDataCompressor'"


def vtk_xml(name, packed, form, grid):
    behind = b""

    def array(label, kind, letter, numbers):
        nonlocal behind
        data = struct.pack("<%d%s" % (len(numbers), letter), *numbers)
        tag = "<DataArray type='%s' Name='%s' format='%s' offset='%d'>" % (kind, label, form, len(behind))
        if form == "ascii":
            return (tag + " ".join("%g" % n for n in numbers) + "</DataArray>\n").encode()
        if packed:
            blocks = [zlib.compress(data[i:i + 8]) for i in range(0, len(data), 8)]
            head = struct.pack("<%dI" % (3 + len(blocks)), len(blocks), 8, len(data) % 8, *map(len, blocks))
            data = b"".join(blocks)
        else:
            head = struct.pack("<I", len(data))
        text = head + data if "raw" in name else base64.b64encode(head) + base64.b64encode(data)
        if form == "binary":
            return tag.encode() + text + b"</DataArray>\n"
        behind += text
        return tag.encode() + b"</DataArray>\n"

    part, count = ("Cells", "Cells='1'") if grid else ("Polys", "Polys='4'")
    body = array("Points", "Float32", "f", sum(POINTS, ()))
    cells = array("connectivity", "Int32", "i", range(4) if grid else sum(FACES, ()))
    cells += array("offsets", "Int64", "q", (4,) if grid else (3, 6, 9, 12))
    cells += array("types", "UInt8", "B", (10,)) if grid else b""
    space = array("SPACE", "String", "B", b"RAS\0").replace(b"DataArray", b"Array")
    data = ("<VTKFile type='%s' header_type='UInt32'%s>" % ("UnstructuredGrid" if grid else "PolyData", packed)
            + "<FieldData>").encode() + space + b"</FieldData>"
    data += ("<Piece NumberOfPoints='4' NumberOf%s><Points>" % count).encode() + body
    data += ("</Points><%s>" % part).encode() + cells + ("</%s></Piece>" % part).encode()
    if behind:
        data += ("<AppendedData encoding='%s'>_" % ("raw" if "raw" in name else "base64")).encode() + behind
        data += b"</AppendedData>"
    return data + b"</VTKFile>\n"


def meshes():
    lines = ["v %g %g %g" % p for p in BASE] + ["vt 0 0", "vt 1 0.5"]
    put("obj", "pyramid", "\n".join(lines + ["f " + " ".join(str(c + 1) for c in f) for f in QUADS]))
    put("obj", "negative", "# c\n" + "\n".join(["v %g %g %g" % p for p in POINTS]
        + ["vt 0 1"] + ["f " + " ".join("%d/1" % (c - 4) for c in f) for f in FACES]) + "\n")
    put("obj", "joined", "o a\ng b\nv 0 0 0 1.0\nv .1 0 \\\n0\nv 0 .1 0\nv .1 .1 0\nvn 0 0 1\n"
        "f 1//1 2//1 3//1\nf 2 4 3\nl 1 2\ns off\nusemtl x\n")
    put("obj", "repairs", "\n".join("v %g %g %g" % p for p in POINTS + POINTS[:1])
        + "\nf 1 3 2\nf 1 2 4\nf 2 4 3\nf 3 5 4\nf 1 1 2\nf 1 3 2\n")
    facets = ["facet normal 0 0 0\nouter loop\n" + "".join("vertex %g %g %g\n" % POINTS[c] for c in f)
              + "endloop\nendfacet\n" for f in FACES]
    put("stl", "ascii", "solid a\n" + "".join(facets) + "endsolid a\n")
    data = b"solid in the header".ljust(80) + struct.pack("<I", len(FACES))
    for f in FACES:
        data += struct.pack("<3f", 0, 0, 0) + b"".join(struct.pack("<3f", *POINTS[c]) for c in f)
        data += b"\0\0"
    put("stl", "binary", data)
    put("stl", "tail", data + b"behind")
    put("obj", "seam", "# SPACE=RAS\n" + "\n".join("v %g %g %.12g" % p for p in BASE + [(0, 1e-9, 1e-9), (0.05, 0.05, 0.100000001)])
        + "\nf 1 4 3 2\nf 1/ 2/ 5/\nf 2 3 5\nf 3 4 5\nf 4// 6// 7//\n")
    floats = b"".join(struct.pack(">3f", *p) for p in POINTS)
    vtk = "# vtk DataFile Version %s\na\n%s\nDATASET POLYDATA\n"
    put("vtk", "polygons", vtk % ("3.0", "ASCII") + "POINTS 4 double\n" + "%g %g %g\n" * 4 % sum(POINTS, ())
        + "VERTICES 1 2\n1 0\nPOLYGONS 4 16\n" + "".join("3 %d %d %d\n" % f for f in FACES) + "POINT_DATA 4\n")
    put("vtk", "strips", vtk % ("5.1", "ASCII") + "FIELD a 1\nb 1 2 int\n7 8\nPOINTS 4 float\n"
        + "%g %g %g\n" * 4 % sum(POINTS, ()) + "TRIANGLE_STRIPS 2 6\nOFFSETS vtktypeint64\n0 6\n"
        "CONNECTIVITY vtktypeint64\n0 2 1 3 0 2\n")
    put("vtk", "binary", (vtk % ("3.0", "BINARY") + "POINTS 4 float\n").encode() + floats + b"\nPOLYGONS 4 16\n"
        + b"".join(struct.pack(">4i", 3, *f) for f in FACES))
    put("vtk", "offsets", (vtk % ("5.1", "BINARY") + "POINTS 4 float\n").encode() + floats
        + b"\nMETADATA\nINFORMATION 0\n\nPOLYGONS 5 12\nOFFSETS vtktypeint64\n" + struct.pack(">5q", 0, 3, 6, 9, 12)
        + b"\nCONNECTIVITY vtktypeint64\n" + b"".join(struct.pack(">3q", *f) for f in FACES))
    put("vtk", "grid", vtk.replace("POLYDATA", "UNSTRUCTURED_GRID") % ("3.0", "ASCII") + "POINTS 4 float\n"
        + "%g %g %g\n" * 4 % sum(POINTS, ()) + "CELLS 2 9\n4 0 1 2 3\n3 0 1 2\nCELL_TYPES 2\n10\n5\n")
    for name, packed, form in (("ascii", "", "ascii"), ("inline", PACKED, "binary"), ("raw", "", "appended"),
                               ("raw-packed", PACKED, "appended"), ("base64", "", "appended")):
        for grid in (False, True):
            put("vtkxml", name + ("-grid" if grid else ""), vtk_xml(name, packed, form, grid))
    put("msh", "1", "$NOD\n4\n" + "".join("%d %g %g %g\n" % (i + 5, *p) for i, p
        in enumerate(POINTS)) + "$ENDNOD\n$ELM\n2\n1 4 1 1 4 5 6 7 8\n2 2 1 1 3 5 6 7\n$ENDELM\n")
    put("msh", "2", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n" + "".join("%d %g %g %g\n" % (i + 5, *p) for i, p
        in enumerate(POINTS)) + "$EndNodes\n$Elements\n2\n1 4 2 0 0 5 6 7 8\n2 2 0 5 6 7\n$EndElements\n")
    put("msh", "4", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n0\n$EndPhysicalNames\n$Nodes\n1 4 1 99\n"
        "2 1 1 4\n99\n8\n7\n1\n" + "".join("%g %g %g 0 0\n" % p for p in POINTS) + "$EndNodes\n$Elements\n1 4 1 4\n"
        "2 1 2 4\n" + "".join("1 %d %d %d\n" % tuple((99, 8, 7, 1)[c] for c in f) for f in FACES) + "$EndElements\n")
    put("msh", "2-binary", b"$MeshFormat\n2.2 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n$Nodes\n4\n"
        + b"".join(struct.pack("<i3d", i + 5, *p) for i, p in enumerate(POINTS)) + b"\n$EndNodes\n$Elements\n5\n"
        + struct.pack("<9i", 4, 1, 1, 1, 0, 5, 6, 7, 8) + struct.pack("<3i", 2, 4, 0)
        + b"".join(struct.pack("<4i", 1, *(c + 5 for c in f)) for f in FACES) + b"\n$EndElements\n")
    put("msh", "4-binary", b"$MeshFormat\n4.1 1 8\n" + struct.pack(">i", 1) + b"\n$EndMeshFormat\n$Nodes\n"
        + struct.pack(">4q3iq4q", 1, 4, 1, 4, 3, 1, 0, 4, 1, 2, 3, 4) + b"".join(struct.pack(">3d", *p) for p in POINTS)
        + b"\n$EndNodes\n$Elements\n" + struct.pack(">4q3iq5q", 1, 1, 1, 1, 3, 1, 4, 1, 1, 1, 2, 3, 4)
        + b"\n$EndElements\n")
    nodes = "\n=data=\n4 3 1 1 # points\n" + "".join("%d %g %g %g 7 8\n" % (i + 1, *p) for i, p in enumerate(POINTS))
    put("tetgen", "four", "1 4 0\n1 1 2 3 4" + nodes)
    put("tetgen", "ten", "# a\n1 10 1\n\n1 1 2 3 4 1 2 3 4 1 2 -1" + nodes)
    for kind, end in (("ascii", None), ("binary_little_endian", "<"), ("binary_big_endian", ">")):
        head = ("ply\nformat %s 1.0\ncomment c\nelement vertex %d\nproperty double x\n"
                "property float y\nproperty float z\nproperty uchar red\nelement face %d\n"
                "property list uchar int vertex_indices\nelement edge 1\nproperty list int short a\n"
                "end_header\n") % (kind, len(BASE), len(QUADS))
        if end is None:
            body = "".join("%g %g %g 7\n" % p for p in BASE)
            body += "".join("%d %s\n" % (len(f), " ".join(map(str, f))) for f in QUADS) + "1 2\n"
            put("ply", kind, head + body)
            continue
        body = b"".join(struct.pack(end + "dffB", *p, 7) for p in BASE)
        body += b"".join(struct.pack(end + "B%di" % len(f), len(f), *f) for f in QUADS)
        put("ply", kind, head.encode() + body + struct.pack(end + "ih", 1, 2))
    for name in ("OFF", "COFF", "NOFF", "STOFF"):
        more = {"OFF": "", "COFF": " 1 0 0 1", "NOFF": " 0 0 1", "STOFF": " 0 1"}[name]
        put("off", name, "%s\n# c\n%d %d 0\n" % (name, len(BASE), len(QUADS))
            + "".join("%g %g %g%s\n" % (*p, more) for p in BASE)
            + "".join("%d %s 255 0 0\n" % (len(f), " ".join(map(str, f))) for f in QUADS))


# --- volumes: 2 x 2 x 2 cells of 10 mm ---

LABELS = bytes([1, 1, 1, 1, 2, 2, 1, 0])
MARK = b"\n=data=\n"


def volumes():
    head = ("NRRD0004\n# c\ntype: uchar\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 2 2\n"
            "space directions: (10,0,0) (0,10,0) (0,0,10)\nspace origin: (1,2,3)\nkinds: domain domain "
            "domain\nkey:=value\n")
    put("nrrd", "raw", (head + "encoding: raw\n\n").encode() + LABELS)
    put("nrrd", "gzip", (head + "encoding: gzip\n\n").encode() + gzip.compress(LABELS, mtime=0))
    put("nrrd", "ascii", head + "encoding: ascii\n\n" + " ".join(map(str, LABELS)) + "\n")
    put("nrrd", "hex", head + "encoding: hex\n\n" + LABELS.hex())
    put("nrrd", "detached", (head + "encoding: raw\nbyte skip: 3\ndata file: data\n").encode() + MARK
        + b"xyz" + LABELS)
    put("nrrd", "detached-gzip", (head + "encoding: gzip\ndata file: data\n").encode() + MARK
        + gzip.compress(LABELS, mtime=0))
    put("nrrd", "spacings", ("NRRD0001\ntype: short\ndimension: 4\nsizes: 1 2 2 2\nspacings: nan 10 10 "
        "10\nendian: big\nencoding: raw\nbyte skip: -1\n\n").encode()
        + b"".join(struct.pack(">h", v) for v in LABELS))
    put("nrrd", "layers", ("NRRD0005\ntype: uchar\ndimension: 4\nsizes: 2 2 2 2\nkinds: list domain domain "
        "domain\nspace: LPS\nspace directions: none (10,0,0) (0,10,0) (0.2,0,10)\nencoding: raw\n"
        "Segment0_Name:=liver\nSegment0_LabelValue:=2\nSegment0_Layer:=1\nSegment0_Color:=0.5 0.5 0.5\n\n"
        ).encode() + bytes(v for pair in zip(LABELS, LABELS) for v in pair))
    put("nrrd", "double", ("NRRD0005\ntype: double\ndimension: 3\nspace: RAS\nsizes: 2 2 2\nspace units:"
        " \"cm\" \"cm\" \"cm\"\nspace directions: (1,0,0) (0,1,0) (0,0,-1)\nendian: little\nencoding: "
        "raw\nline skip: 1\n\nline\n").encode() + struct.pack("<8d", *LABELS))

    def nifti(end, magic, offset, kind, bits, **more):
        head = bytearray(348)
        struct.pack_into(end + "i", head, 0, 348)
        struct.pack_into(end + "8h", head, 40, 3, 2, 2, 2, 1, 1, 1, 1)
        struct.pack_into(end + "2h", head, 70, kind, bits)
        struct.pack_into(end + "8f", head, 76, 1, 10, 10, 10, 0, 0, 0, 0)
        struct.pack_into(end + "3f", head, 108, offset, more.get("slope", 0), 0)
        head[123] = 2
        struct.pack_into(end + "2h", head, 252, 1, more.get("sform", 0))
        struct.pack_into(end + "6f", head, 256, 0, 0, 0, 1, 2, 3)
        struct.pack_into(end + "12f", head, 280, 10, 0, 0, 1, 0, 10, 0, 2, 0, 0, 10, 3)
        head[344:348] = magic
        return bytes(head)

    single = nifti("<", b"n+1\0", 352, 2, 8) + bytes(4) + LABELS
    put("nifti", "plain", single)
    put("nifti", "gzipped", gzip.compress(single, mtime=0))
    put("nifti", "big", nifti(">", b"n+1\0", 352, 4, 16, slope=1.0, sform=1) + bytes(4)
        + struct.pack(">8h", *LABELS))
    put("nifti", "float", nifti("<", b"n+1\0", 352, 16, 32, sform=1) + bytes(4)
        + struct.pack("<8f", *LABELS))
    put("nifti", "pair", nifti("<", b"ni1\0", 0, 2, 8) + MARK + LABELS)


# --- scenes ---

SURFACE = """name = "s"; rate_hz = 500.0; precision = "double"; threads = 2;
publish = { nodes_hz = 30.0; nodes = "all"; velocity = true; };
bodies = ( { name = "ball"; mesh = { generator = "%s"; };
  levels = 1; start_level = 0; adjust = "continuum"; cuttable = true; prestress = 0.1;
  adapt = { force = 0.005; speed = 0.3; curvature = 0.4; check_hz = 100.0; };
  material = { youngs_modulus_2d = 80.0; areal_density = 4.2; damping_time = 2.0e-4; };
  shape = { angular_frequency = 50.0; damping_ratio = 0.1; frame = "body"; };
  integrator = "%s";
  fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.03]); }, { nodes = [0, 1]; } ); } );
tools = ( { id = 1; kind = "probe"; max_force = 3.3;
    capsules = ( { from = [0.0, 0.0, 0.0]; to = [0.0, 0.0, 0.1]; radius = 0.005; } ); },
  { id = 2; kind = "blade"; edge = ( [0.0, 0.0, 0.0], [0.0, 0.0, 0.02] ); },
  { id = 3; kind = "grasper"; capsules = ( { radius = 0.006; } ); grip_stiffness = 0.3; },
  { id = 4; kind = "static"; plane = { point = [0.0, 0.0, -0.06]; normal = [0.0, 0.0, 1.0]; }; } );
attachments = ( { body = "ball"; to = "world"; sphere = [0.05, 0.0, 0.0]; radius = 0.02; } );
loads = ( { body = "ball"; center = [0.05, 0.0, 0.0]; radius = 0.03; force = [0.0, 0.5, 0.0];
            start = 0.0; duration = 0.5; } );
"""
VOXEL = """gravity = [0.0, 0.0, -9.81];
bodies = ( { name = "b"; model = "voxel"; voxels = { %s };
  levels = 1; law = "%s"; cuttable = true; split_budget = 4; tear = { stress = 2000.0; };
  material = { youngs_modulus = 5000.0; poisson_ratio = %s; density = 1000.0; damping = 0.2; };
%s  fixed = ( { sphere = [0.0, 0.0, -0.02]; radius = 0.02; } ); } );
"""


def scenes():
    put("scene", "minimal", 'bodies = ( { name = "a"; mesh = { generator = "uv_sphere"; }; } );\n')
    put("scene", "surface", SURFACE % ("uv_sphere", "leapfrog"))
    put("scene", "stomach", SURFACE.replace('"%s"; }', '%s }') % (
        '"stomach"; nodes = 60; length = 0.1;', "rk4"))
    put("scene", "implicit", SURFACE.replace('"%s"; }', '%s }') % (
        '"ico_sphere"; subdivisions = 1; radius = 0.05;', "implicit"))
    put("scene", "file", SURFACE.replace("0.05, 0.0, 0.0]; r", "0.0, 0.1, 0.0]; r").replace('generator = "%s"', 'file = "m.obj"; scale = 1.0; place = { '
        'translation = [0.0, 0.0, 0.0]; rotation = [0.1, 0.0, 0.0]; }') % "symplectic_euler")
    put("scene", "sheet", 'bodies = ( { name = "a"; mesh = { generator = "sheet"; columns = 4; rows = 5; '
        'width = 0.1; height = 0.2; }; shape = { stiffness = 1.0; damping = 0.01; }; } );\n')
    put("scene", "sheet-huge", 'bodies = ( { name = "a"; mesh = { generator = "sheet"; columns = 4000; '
        'rows = 4000; }; } );\n')
    put("scene", "box", VOXEL % ('generator = "box"; count = [3, 3, 3]; size = 0.01;', "affine", "0.0", ""))
    put("scene", "ball", VOXEL % ('generator = "ball"; radius = 0.03; size = 0.01;', "miyazaki2004",
        "0.0", ""))
    put("scene", "disc", 'bodies = ( { name = "d"; model = "voxel"; dimensions = 2; voxels = { generator ='
        ' "disc"; radius = 0.03; size = 0.01; }; material = { youngs_modulus = 5000.0; }; } );\n')
    put("scene", "volume", VOXEL % ('file = "v.nrrd"; label = [1, 2];', "affine", "0.2",
        "  materials = ( { label = 2; youngs_modulus = 20000.0; } );\n"))
    put("scene", "filled", (VOXEL % ('mesh = "m.obj"; size = 0.02;', "affine", "0.2", "")).replace(
        'levels = 1;', 'levels = 0; skin = { mesh = "m.obj"; };'))
    put("scene", "include", '@include "i.cfg"\n/* c */ // c\nbodies = ( { name = "a"; mesh = { generator = '
        '"sphere"; nodes = 0x20; }; } ); # c\n')
    put("scene", "include-loop", '@include "loop.cfg"\n')


# --- texts of clients ---

def texts():
    put("text", "poses", "\0# t x y z qw qx qy qz\n0 0 0 0.1\n0.5 0 0 0.05 1 0 0 0\n1 0 0 0.1 0 1 0 0\n")
    put("text", "edges", "\1# edge\n0 0 0 0 0 0.1\n0.1 0 0 0.1 0 0.1\nlift\n0 0.1 0 0 0.1 0.1\n"
        "0.1 0.1 0 0.1 0.1 0.1\n")
    put("text", "vector", "\0020.1,-2e-1,3")
    put("text", "number", "\00212.5")
    put("text", "integer", "\00242")
    put("text", "url", "\2udpm://239.255.76.67:7667?ttl=1")
    put("text", "file", "\2file:///tmp/x?speed=0")


# --- pages of pliant-web ---

def pages():
    for name, text in (
            ("drawn", '{"type": "drawn", "round": 5}'),
            ("tool", '{"type": "tool", "tool": 1, "position": [0.0, 0.1, 0.2], "orientation": [1, 0, 0, 0], '
                     '"grip": 0.5, "active": true}'),
            ("cut", '{"type": "cut", "id": 3, "before": [[0, 0, 0], [0, 0, 0.1]], "after": [[0.1, 0, 0], '
                    '[0.1, 0, 0.1]], "body": "ball"}'),
            ("load", '{"type": "load", "id": 4, "center": [0, 0, 0], "radius": 0.01, "force": [0, 0, 1e0], '
                     '"duration": 0.5, "body": ""}'),
            ("command", '{"type": "command", "id": 5, "kind": "set", "value": 1, "argument": "gravity=0"}'),
            ("start", '{"type": "start", "id": 6, "folder": "uploads", "name": "organ.cfg"}'),
            ("propose", '{"type": "propose", "id": 7, "name": "organ.stl", "units": "mm", "model": "voxel"}')):
        put("page", name, "\0" + text)
    put("page", "mesh-name", "\1../meshes/my organ.nii.gz")
    put("page", "host", "\1localhost:8080\nhttp://localhost:8080")
    put("page", "host-six", "\1[::1]:8080\nhttps://[::1]:8080")
    put("page", "token", "\0010123456789abcdef")
    # Of a WebSocket: two texts, a ping, a text of 256 bytes, and one that claims 300 MB.
    mask, text = b"\0\0\0\0", b'{"type": "drawn"}'
    put("page", "frames", b"\3" + 2 * (bytes([0x81, 0x80 | len(text)]) + mask + text) + b"\x89\x80" + mask +
        b"\x81\xfe\x01\x00" + mask + 256 * b"x")
    put("page", "frame-too-big", b"\3\x81\xff" + struct.pack(">Q", 300000000) + mask)
    put("page", "describe", "\2scene 's' at 500 Hz\ntool 1: probe, 1 capsules, max_force 5 N\n  capsule [0, 0, "
        "0] to [0, 0, 0.1], radius 0.005 m\ntool 2: blade, 0 capsules\n  edge [0, 0, 0] to [0, 0, 0.02] m\n"
        "tool 4: static, 0 capsules\n  plane [0, 0, 0] m, normal [0, 0, 1]\n")


# --- messages ---

def load_types():
    folder = tempfile.mkdtemp()
    files = [os.path.join(TYPES, name) for name in os.listdir(TYPES) if name.endswith(".lcm")]
    subprocess.run(["lcm-gen", "-p", "--ppath", folder] + files, check=True)
    sys.path.insert(0, folder)
    import pliant
    return pliant


def fill(message, **fields):
    for name, value in fields.items():
        assert hasattr(message, name), name
        setattr(message, name, value)
    return message


def inputs(pliant):
    return {
        "pose": (0, fill(pliant.tool_pose_t(), utime=1, sender=1, sequence=1, tool=1,
                         position=[0.0, 0.0, 0.15], orientation=[1.0, 0.0, 0.0, 0.0], active=True)),
        "pose-twist": (0, fill(pliant.tool_pose_t(), utime=2, sender=1, sequence=2, tool=3,
                               position=[0.05, 0.0, 0.0], orientation=[0.0, 1.0, 0.0, 0.0],
                               twist=[0.1, 0.0, 0.0, 0.0, 1.0, 0.0], twist_valid=True, grip=1.0,
                               active=True)),
        "cut": (1, fill(pliant.cut_t(), sender=1, id=1, before=[[-0.1, 0.0, -0.1], [-0.1, 0.0, 0.1]],
                        after=[[0.1, 0.0, -0.1], [0.1, 0.0, 0.1]], body="ball")),
        "load": (2, fill(pliant.load_t(), sender=1, id=2, center=[0.05, 0.0, 0.0], radius=0.03,
                         force=[0.1, 0.0, 0.0], duration=0.1, body="")),
        "set": (3, fill(pliant.command_t(), sender=2, id=3, kind=7, argument="gravity=0 0 -9.81")),
        "step": (3, fill(pliant.command_t(), sender=2, id=4, kind=3, value=5, argument="")),
        "reset": (3, fill(pliant.command_t(), sender=2, id=5, kind=4, argument="")),
        "tie": (4, fill(pliant.tie_t(), sender=2, id=7, action=1, kind=1, center=[0.05, 0.0, 0.0], radius=0.03,
                        stiffness=0.3, damping_ratio=0.5, to_body=bytes(32), body="ball")),
        "clip": (4, fill(pliant.tie_t(), sender=2, id=8, action=1, tie=2, kind=3, radius=0.06, stiffness=0.1,
                         damping_ratio=0.5, break_force=1.0, to_body=bytes(32), body="ball")),
        "untie": (4, fill(pliant.tie_t(), sender=2, id=9, action=3, tie=2, to_body=bytes(32), body="")),
        "stop": (3, fill(pliant.command_t(), sender=2, id=6, kind=8, argument="")),
    }


CHANNELS = ["TOOL_POSE", "CUT", "LOAD", "COMMAND", "TIE"]


def event(number, time, channel, data):
    channel = channel.encode()
    return struct.pack(">IqqII", 0xEDA1DA01, number, time, len(channel), len(data)) + channel + data


def messages(pliant):
    sent = inputs(pliant)
    plain = event(0, 0, "LCM_SELF_TEST", b"x")
    exact = event(0, 0, "PLIANT_INPUT_LOG", b"format = pliant-input-log\nversion = 1\nscene = fuzz\n"
                  b"prefix = PLIANT\nisa = baseline\nrate_hz = 500\nstep = 0\n")
    for number, (name, (kind, message)) in enumerate(sent.items()):
        data = message.encode()
        put("input", name, bytes([kind]) + data)
        put("input", name + "-body", bytes([64 + kind]) + data[8:])
        if name != "stop":
            plain += event(number, 4000 * number, "PLIANT_" + CHANNELS[kind], data)
            exact += event(number, 2000 * number + 10000, "PLIANT_" + CHANNELS[kind], data)
    put("log", "plain", plain + event(9, 50000, "OTHER", b"abc"))
    put("log", "exact", exact + event(9, 40000, "PLIANT_INPUT_LOG", b"end\nstep = 20\nlost = 0\n"))
    put("log", "exact-rate", exact.replace(b"= 500", b"= 250"))

    def frame(*parts):
        out = b""
        # From 64 on: with the right fingerprint. 70 is a multiple of KINDS in fuzz_frames.c.
        for kind, message in parts:
            data = message.encode()[8:]
            out += bytes([70 + kind]) + struct.pack(">H", len(data)) + data
        return out

    def mesh(first, count, chunk, chunks, topology=1, sequence=1):
        ids = list(range(first, first + count))
        triangle = [0, 2, 1, 0, 1, 3] if chunk == 0 else [1, 2, 3, 2, 0, 3]
        return (1, fill(pliant.mesh_t(), sequence=sequence, topology=topology, node_count=4,
                        triangle_count=4, chunk=chunk, chunk_count=chunks, first_triangle=2 * chunk,
                        num_indices=6, triangle=triangle, first_node=first, num_nodes=count,
                        num_parents=2 * count, id=ids, origin=ids, parent=[i for i in ids for _ in "12"],
                        piece=[0] * count, level=bytes(count)))

    def nodes(first, count, chunk, chunks, topology=1, sequence=1):
        return (0, fill(pliant.nodes_t(), sequence=sequence, step=5, time=0.01, topology=topology,
                        node_count=4, chunk=chunk, chunk_count=chunks, first=first,
                        num_values=3 * count, position=[0.5] * (3 * count)))

    delta = (2, fill(pliant.mesh_delta_t(), sequence=1, from_topology=1, topology=2, node_count=5,
                     triangle_count=5, chunk=0, chunk_count=1, num_triangles=1, num_indices=3,
                     triangle_slot=[4], triangle=[0, 1, 4], num_nodes=1, num_parents=2, node_slot=[4],
                     id=[4], origin=[4], parent=[0, 1], piece=[0], level=b"\1"))
    put("frames", "mesh", frame(mesh(0, 2, 0, 2), mesh(2, 2, 1, 2), nodes(0, 2, 0, 2), nodes(2, 2, 1, 2),
                                delta, nodes(0, 4, 0, 1, 2, 2)))
    rest = (9, fill(pliant.rest_t(), sequence=1, topology=1, node_count=4, chunk=0, chunk_count=1,
                    num_values=12, position=[0.5] * 12, num_coordinates=8, texture=[0.25] * 8))
    put("frames", "rest", frame(rest))
    # Widths 1, 1, 1, and twelve bits; of the second frame nothing but the last packet.
    points = [(10, fill(pliant.points_t(), sequence=sequence, step=5 * sequence, time=0.01, topology=1,
                        node_count=8, first=first, count=4, grid=2.0 ** -17, origin=[100, -200, 300],
                        num_bytes=4, data=b"\x08\x42\xa5\xa0"))
              for sequence, first in ((1, 0), (1, 4), (2, 4))]
    put("frames", "points", frame(*points, nodes(0, 4, 0, 1)))
    contact = (3, fill(pliant.contact_t(), sequence=1, tool=1, step=5, time=0.01, contact=True,
                       position=[0.0, 0.0, 0.1], force=[0.0, 0.0, 1.0], normal=[0.0, 0.0, 1.0]))
    body = fill(pliant.body_status_t(), name="ball", model="surface", integrator="leapfrog", nodes=42)
    status = (4, fill(pliant.status_t(), scene="s", state="running", step=5, rate_hz=500.0, num_stages=2,
                      stage=["inputs", "tools"], stage_us=[1.0, 2.0], num_bodies=1, body=[body],
                      num_reasons=1, reason=["wrong_size"], count=[3]))
    happened = (5, fill(pliant.event_t(), sequence=1, step=5, body="ball", kind="cut", text="a\nb"))
    reply = (6, fill(pliant.reply_t(), sender=1, id=1, ok=True, channel="PLIANT_CUT", text="done\n\x01"))
    put("frames", "told", frame(contact, status, happened, reply))
    error = (12, fill(pliant.error_t(), sequence=1, step=5, time=0.01, num_bodies=1, num_tools=1,
                      body=[fill(pliant.error_body_t(), name="ball", space=1e-4, steps=-1.0, age=3)],
                      tool=[fill(pliant.error_tool_t(), tool=1, force=0.5, error=0.1, share=0.2)]))
    maps = [(13, fill(pliant.error_map_t(), sequence=1, step=5, topology=1, node_count=4, chunk=chunk,
                      chunk_count=2, first=2 * chunk, num_values=2, share=bytes([0, 255])))
            for chunk in range(2)]
    put("frames", "errors", frame(error, *maps))
    elements = [(14, fill(pliant.elements_t(), sequence=1, step=5, topology=1, square_count=4, chunk=chunk,
                          chunk_count=2, first=2 * chunk, num_levels=2, num_squares=2, elements=[9, 1],
                          level=bytes([0, 1]), tag=[3, -4]))
                for chunk in range(2)]
    put("frames", "elements", frame(*elements))
    put("frames", "whole", b"".join(bytes([kind]) + struct.pack(">H", len(m.encode())) + m.encode()
                                    for kind, m in (nodes(0, 4, 0, 1), contact, happened)))
    return sent


# --- sessions: the encoding of fuzz_session.c ---

def number(value, scale):
    return struct.pack(">h", max(-32766, min(32766, round(value / scale * 16384))))


def sessions():
    def pose(tool, x, y, z, bits=1, turn=0, sender=0, extra=b""):
        return (bytes([0, sender, 1, tool]) + b"".join(number(v, 0.2) for v in (x, y, z))
                + bytes([turn, bits]) + extra)

    def cut(ident, before, after, body=0):
        out = bytes([1, 0, ident])
        for k in range(2):
            for c in range(3):
                out += number(before[k][c], 0.2) + number(after[k][c], 0.2)
        return out + bytes([body])

    def load(ident, center, force, radius, duration, body=0):
        out = bytes([2, 0, ident])
        for c in range(3):
            out += number(center[c], 0.1) + bytes([0]) + number(force[c], 1.0)
        return out + number(radius, 0.1) + number(duration, 0.1) + bytes([body])

    def setting(ident, index):
        return bytes([3, 0, ident, 0]) + number(0, 1) + bytes([0, index])

    tick, ticks = b"\4", b"\6"
    press = b"".join(pose(1, 0.0, 0.0, 0.07 - 0.002 * i) + tick for i in range(12))
    put("session", "press", press)
    put("session", "press-block", b"".join(pose(1, 0.1, 0.0, 0.06 - 0.002 * i) + tick for i in range(12)))
    put("session", "cuts", cut(1, ((-0.1, 0, -0.1), (-0.1, 0, 0.1)), ((0.05, 0, -0.1), (0.05, 0, 0.1)))
        + ticks + cut(2, ((0.02, 0.003, -0.1), (0.02, 0.003, 0.1)), ((0.18, 0.003, -0.1),
        (0.18, 0.003, 0.1))) + ticks)
    put("session", "blade", b"".join(pose(2, 0.04 - 0.006 * i, 0.001, -0.02) + tick for i in range(14)))
    put("session", "blade-block", b"".join(pose(2, 0.16 - 0.008 * i, 0.011, -0.02) + tick
                                           for i in range(14)))
    put("session", "grasp", b"".join(pose(3, 0.05 + 0.004 * i, 0, 0, bits=17) + tick for i in range(12)))
    put("session", "loads", load(1, (0.05, 0, 0), (0.5, 0, 0), 0.03, 0.02) + ticks
        + load(2, (0.1, 0, 0.04), (0, 0, 1.5), 0.05, 0.05) + ticks + load(3, (0, 0, 0), (0, 0, 1), 0.001,
        0.1) + ticks)
    put("session", "settings", b"".join(setting(i, i) + tick for i in range(18)))
    put("session", "reset", press[:60] + bytes([3, 0, 9, 1]) + number(0, 1) + bytes([0, 0]) + ticks)


# --- packets of LCM: where it comes from, then the packet ---

def packets():
    def whole(channel, data):
        return b"\0LC02" + struct.pack(">I", 1) + channel + b"\0" + data

    def fragment(size, offset, number, count, channel, data):
        return b"\0LC03" + struct.pack(">IIIHH", 1, size, offset, number, count) + channel + data

    put("packet", "whole", whole(b"PLIANT_COMMAND", b"data"))
    put("packet", "pattern", whole(b"PLIANT_NODES_liver", b""))
    put("packet", "remote", b"\1" + whole(b"PLIANT_COMMAND", b"data")[1:])
    put("packet", "remote-heard", b"\3" + whole(b"PLIANT_COMMAND", b"data")[1:])
    put("packet", "longest-channel", whole(b"c" * 63, b"x"))
    put("packet", "long-channel", whole(b"c" * 64, b"x"))
    put("packet", "no-end", whole(b"PLIANT_COMMAND", b"")[:-1])
    put("packet", "no-channel", whole(b"", b"x"))
    put("packet", "short", b"\0LC02\0\0")
    put("packet", "magic", b"\0LC04" + b"\0" * 30)
    put("packet", "fragment", fragment(9, 0, 0, 1, b"PLIANT_COMMAND\0", b"x" * 9))
    put("packet", "second-fragment", fragment(9, 4, 1, 2, b"", b"x" * 5))
    # What ended programs with liblcm inside: the sum of offset and size wraps around.
    put("packet", "wrap-546", fragment(600, 0xffffff00, 0, 1, b"PLIANT_COMMAND\0", b"x" * 511))
    put("packet", "claim-256-mb", fragment(1 << 28, 0, 0, 4100, b"PLIANT_COMMAND\0", b"x" * 102))


# --- HDF5: the encoding of hdf_edit.c, with an even byte in front ---

def words(edit, index, form, values):
    data = b"".join(struct.pack(form, value) for value in values)
    return edit(0, index, bytes([0, 0, 0, 1]) + struct.pack(">H", len(data)) + data)


# Checkpoints of the world of solids that adapt: sets that say how their elements are divided, who
# steers that, and where their batches are.
def solids_that_adapt(edit):
    for index in (7, 8, 9, 11, 12, 24, 26, 27, 29, 34, 61, 62, 64, 66, 69, 88):
        put("checkpoint", "adapts-byte-%d" % index,
            b"\2" + edit(0, index, bytes([0, 0, 8, 1, 0, 2, 255, 255])))
        put("checkpoint", "adapts-number-%d" % index, b"\2" + edit(3, index, bytes([0, 0, 1, 9])))
    put("checkpoint", "adapts-nothing", b"\2")
    # Many batches are of one range, and too few are left for others.
    for name, index in ("lump", 29), ("pad", 66):
        put("checkpoint", "found-batches-" + name, b"\2" + words(edit, index, "<i", [1] * 32))
    # Sums of corners below zero, while they are compared.
    put("checkpoint", "found-corners", b"\2" + words(edit, 11, "<f", [-1e30] * 512) +
        words(edit, 10, "<i", [1]) + words(edit, 9, "<i", [0]) +
        words(edit, 8, "<q", [2, 0, 0, -1])) # a round begins at once


def edits():
    def edit(what, index, rest):
        return bytes([what]) + struct.pack(">H", index) + rest

    for corpus, sets in (("initial", 2), ("checkpoint", 60), ("prepared", 16), ("recording", 20)):
        put(corpus, "nothing", b"\0")
        put(corpus, "not-hdf5", b"\1not HDF5")
        for index in range(0, sets, max(1, sets // 10)):
            put(corpus, "byte-%d" % index, b"\0" + edit(0, index, bytes([0, 0, 8, 1, 0, 2, 255, 255])))
            put(corpus, "number-%d" % index, b"\0" + edit(3, index, bytes([0, 0, 1, 2, 0, 1])))
        put(corpus, "rows", b"\0" + edit(5, 0, bytes([2, 8])))
        put(corpus, "columns", b"\0" + edit(5, 0, bytes([4, 2])))
        put(corpus, "type", b"\0" + edit(5, 0, bytes([16, 2])))
        put(corpus, "claims", b"\0" + edit(5, 0, bytes([2 + 32, 10])))
        put(corpus, "missing", b"\0" + edit(6, 1, b""))
        if corpus == "checkpoint":
            solids_that_adapt(edit)
        put(corpus, "attribute", b"\0" + edit(7, 1, bytes([2, 1, 1])))
        put(corpus, "attribute-text", b"\0" + edit(7, 1, bytes([2, 0, 2, 0, 3]) + b"abc"))


meshes()
volumes()
scenes()
texts()
pages()
messages(load_types())
sessions()
packets()
edits()
