"""A box as a STEP file (ISO 10303-21, AP214), written entity by entity."""

from collections.abc import Sequence
from itertools import product

MILLIMETRE = "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))"
METRE = "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.))"


class _File:
    """Entities by their numbers."""

    def __init__(self) -> None:
        self.rows: list[str] = []

    def add(self, text: str) -> str:
        self.rows.append(text)
        return f"#{len(self.rows)}"

    def numbers(self, entity: str, values: Sequence[float]) -> str:
        return self.add(f"{entity}('',({','.join(f'{float(v):.9E}' for v in values)}))")

    def several(self, entity: str, parts: Sequence[str], rest: str = "") -> str:
        return self.add(f"{entity}('',({','.join(parts)}){rest})")

    def placement(self, at: Sequence[float], z: Sequence[float], x: Sequence[float]) -> str:
        point, axis, side = (
            self.numbers("CARTESIAN_POINT", at), self.numbers("DIRECTION", z),
            self.numbers("DIRECTION", x),
        )  # fmt: skip
        return self.add(f"AXIS2_PLACEMENT_3D('',{point},{axis},{side})")


def step_box(
    size: tuple[float, float, float], unit: str = MILLIMETRE, inch: bool = False,
    color: tuple[float, float, float] | None = None,
) -> str:  # fmt: skip
    """A box with a corner at the origin; ``color`` is sRGB."""
    file = _File()
    length = file.add(unit)
    if inch:
        powers = file.add("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)")
        factor = file.add(f"LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),{length})")
        length = file.add(
            f"(CONVERSION_BASED_UNIT('INCH',{factor})LENGTH_UNIT()NAMED_UNIT({powers}))"
        )
    angle = file.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
    solid_angle = file.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
    error = file.add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),{length},'','')")
    context = file.add(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)"
        f"GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({error}))"
        f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid_angle}))"
        "REPRESENTATION_CONTEXT('',''))"
    )
    shell = file.several("CLOSED_SHELL", _faces(file, size))
    solid = file.add(f"MANIFOLD_SOLID_BREP('box',{shell})")
    origin = file.placement((0, 0, 0), (0, 0, 1), (1, 0, 0))
    shape = file.several("ADVANCED_BREP_SHAPE_REPRESENTATION", [origin, solid], f",{context}")
    _product(file, shape)
    if color is not None:
        _color(file, solid, context, color)
    rows = "".join(f"#{k}={row};\n" for k, row in enumerate(file.rows, 1))
    head = "FILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
    schema = "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\n"
    return (
        f"ISO-10303-21;\nHEADER;\n{head}{schema}ENDSEC;\nDATA;\n{rows}ENDSEC;\nEND-ISO-10303-21;\n"
    )


def _faces(file: _File, size: Sequence[float]) -> list[str]:
    places = {c: [a * b for a, b in zip(c, size, strict=True)] for c in product((0, 1), repeat=3)}
    vertices = {
        c: file.add(f"VERTEX_POINT('',{file.numbers('CARTESIAN_POINT', p)})")
        for c, p in places.items()
    }
    edges: dict[tuple[tuple[int, ...], tuple[int, ...]], str] = {}
    for a, b in product(places, places):
        if a < b and sum(x != y for x, y in zip(a, b, strict=True)) == 1:
            along = [y - x for x, y in zip(a, b, strict=True)]
            vector = file.add(f"VECTOR('',{file.numbers('DIRECTION', along)},1.)")
            start = file.numbers("CARTESIAN_POINT", places[a])
            line = file.add(f"LINE('',{start},{vector})")
            edges[a, b] = file.add(f"EDGE_CURVE('',{vertices[a]},{vertices[b]},{line},.T.)")
    faces = []
    for axis, side in product(range(3), (0, 1)):
        corners = []
        for s, t in ((0, 0), (1, 0), (1, 1), (0, 1))[:: 1 if side else -1]:
            corner = [side, side, side]
            corner[(axis + 1) % 3], corner[(axis + 2) % 3] = s, t
            corners.append(tuple(corner))
        loop = []
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            same = (a, b) in edges
            edge = edges[(a, b) if same else (b, a)]
            loop.append(file.add(f"ORIENTED_EDGE('',*,*,{edge},{'.T.' if same else '.F.'})"))
        bound = file.add(f"FACE_OUTER_BOUND('',{file.several('EDGE_LOOP', loop)},.T.)")
        normal = [(2 * side - 1) * (k == axis) for k in range(3)]
        across = [float(k == (axis + 1) % 3) for k in range(3)]
        place = file.placement(places[corners[0]], normal, across)
        plane = file.add(f"PLANE('',{place})")
        faces.append(file.several("ADVANCED_FACE", [bound], f",{plane},.T."))
    return faces


def _product(file: _File, shape: str) -> None:
    field = file.add("APPLICATION_CONTEXT('automotive design')")
    file.add(f"APPLICATION_PROTOCOL_DEFINITION('','automotive_design',2000,{field})")
    context = file.add(f"PRODUCT_CONTEXT('',{field},'mechanical')")
    thing = file.add(f"PRODUCT('box','box','',({context}))")
    version = file.add(f"PRODUCT_DEFINITION_FORMATION('','',{thing})")
    design = file.add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{field},'design')")
    whole = file.add(f"PRODUCT_DEFINITION('design','',{version},{design})")
    described = file.add(f"PRODUCT_DEFINITION_SHAPE('','',{whole})")
    file.add(f"SHAPE_DEFINITION_REPRESENTATION({described},{shape})")


def _color(file: _File, solid: str, context: str, color: Sequence[float]) -> None:
    rgb = file.add(f"COLOUR_RGB('',{','.join(f'{c:.9E}' for c in color)})")
    area = file.several("FILL_AREA_STYLE", [file.add(f"FILL_AREA_STYLE_COLOUR('',{rgb})")])
    side = file.several("SURFACE_SIDE_STYLE", [file.add(f"SURFACE_STYLE_FILL_AREA({area})")])
    usage = file.add(f"SURFACE_STYLE_USAGE(.BOTH.,{side})")
    style = file.add(f"PRESENTATION_STYLE_ASSIGNMENT(({usage}))")
    item = file.add(f"STYLED_ITEM('',({style}),{solid})")
    name = "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION"
    file.several(name, [item], f",{context}")
