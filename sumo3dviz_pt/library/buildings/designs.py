"""How the sorts of buildings look: bays, windows, storeys, roofs."""

from __future__ import annotations

from dataclasses import replace

from sumo3dviz_pt.library.buildings.build import Design
from sumo3dviz_pt.library.buildings.facade import Facade

_TALL = Facade(
    bay=2.9, width=1.15, height=2.0, sill=0.75, inset=0.2, surround=0.14, hood=True, transom=0.7
)
_PARTY = Facade(bay=5.5, width=0.9, height=1.5, sill=0.95, inset=0.16, boards=False)

_EIXAMPLE = Design(
    upper=_TALL,
    sides=_PARTY,
    ground=4.3,
    storey=3.35,
    plinth=0.0,
    foot="shops",
    roof="mansard",
    courses=0.07,
    cornice=0.45,
    balconies="iron",
    dormers=True,
)
PERIMETER = (
    _EIXAMPLE,
    replace(
        _EIXAMPLE,
        upper=replace(_TALL, hood=False, bay=3.2, width=1.25),
        balconies="iron",
        roof="flat",
        parapet=0.9,
        lift=True,
    ),
    replace(
        _EIXAMPLE,
        foot="door",
        plinth=0.45,
        ground=4.0,
        balconies="none",
        unit=18.0,
        upper=replace(_TALL, bay=2.7),
    ),
)
"""Houses of the 1890s in closed blocks: shops, tall windows, cornices, mansards."""

_SASH = Facade(
    bay=2.75, width=1.1, height=1.65, sill=0.85, inset=0.14, lintel=True, transom=0.5, mullions=0
)
TENEMENT = (
    Design(
        upper=_SASH,
        sides=replace(_PARTY, lintel=True),
        ground=3.5,
        storey=3.05,
        plinth=0.5,
        unit=9.0,
        roof="flat",
        parapet=1.0,
        courses=0.03,
        cornice=0.25,
        lift=True,
    ),
    Design(
        upper=replace(_SASH, bay=3.3, width=1.5, mullions=1),
        sides=_PARTY,
        ground=4.0,
        storey=3.0,
        plinth=0.0,
        foot="shops",
        roof="flat",
        parapet=0.8,
        cornice=0.15,
        balconies="solid",
        lift=True,
    ),
)
"""Tenements of brick with lintels."""

_POSTWAR = Facade(bay=3.6, width=1.75, height=1.4, sill=0.9, inset=0.13, transom=0.0, drapes=0.55)
SLAB = (
    Design(
        upper=_POSTWAR,
        sides=replace(_PARTY, bay=6.0),
        ground=3.1,
        storey=2.8,
        plinth=0.6,
        unit=9.0,
        roof="flat",
        parapet=0.5,
        courses=0.025,
        balconies="gallery",
        lift=True,
    ),
    Design(
        upper=_POSTWAR,
        sides=replace(_PARTY, bay=6.0),
        ground=3.2,
        storey=2.8,
        plinth=0.5,
        unit=11.0,
        roof="flat",
        parapet=0.6,
        balconies="solid",
        lift=True,
    ),
    Design(
        upper=replace(_POSTWAR, bay=3.0, width=1.45),
        sides=replace(_PARTY, bay=6.0),
        ground=3.2,
        storey=2.8,
        plinth=0.5,
        unit=11.0,
        roof="flat",
        parapet=0.6,
        courses=0.02,
        balconies="glass",
        lift=True,
    ),
)
"""Rendered slabs of the 1960s with balconies."""

OFFICE = Design(
    upper=Facade(
        bay=1.35,
        width=0.0,
        height=1.95,
        sill=0.9,
        inset=0.12,
        drapes=0.3,
        mullions=0,
        boards=False,
        transom=0.72,
    ),
    low=Facade(bay=2.7, width=0.0, height=3.0, sill=0.1, inset=0.35, drapes=0.0, boards=False),
    ground=4.2,
    storey=3.5,
    plinth=0.15,
    unit=30.0,
    parapet=0.9,
    lift=True,
)
"""An office block with bands of glass."""

CURTAIN_WALL = replace(
    OFFICE,
    upper=Facade(
        bay=1.5, width=0.0, height=2.55, sill=0.55, inset=0.06, drapes=0.1, mullions=0, boards=False
    ),
    storey=3.6,
    parapet=1.2,
)
"""An office block whose walls are glass from floor to floor."""

_COTTAGE = Facade(bay=2.8, width=1.2, height=1.3, sill=0.9, inset=0.14, drapes=0.7)
GABLED = Design(
    upper=_COTTAGE,
    sides=replace(_COTTAGE, bay=3.6),
    storey=2.55,
    plinth=0.35,
    roof="gable",
    pitch=0.75,
)
"""A family house under a steep gabled roof."""

HIPPED = Design(
    upper=replace(_COTTAGE, bay=3.2, width=1.4),
    storey=2.75,
    plinth=0.5,
    roof="hip",
    pitch=0.52,
    courses=0.0,
)
"""A villa under a hipped roof."""

BUNGALOW = Design(
    upper=Facade(
        bay=3.6, width=2.3, height=2.0, sill=0.3, inset=0.16, drapes=0.5, boards=False, mullions=1
    ),
    sides=Facade(bay=4.0, width=1.6, height=1.0, sill=1.25, inset=0.14, mullions=1),
    storey=3.0,
    plinth=0.15,
    roof="flat",
    parapet=0.3,
    cornice=0.55,
)
"""A flat-roofed house with large windows."""

ROW = Design(
    upper=replace(_COTTAGE, bay=2.6, width=1.15, lintel=True),
    storey=2.7,
    plinth=0.3,
    unit=5.5,
    roof="gable",
    pitch=0.72,
)
"""Row houses, each with its door and chimney."""

PAVILION = Design(
    upper=Facade(bay=3.0),
    sides=Facade(bay=4.2, width=1.6, height=0.9, sill=2.2, drapes=0.0),
    plinth=0.0,
    foot="band",
    storey=4.0,
    parapet=0.7,
)
"""A single-storey shop with a glazed front under a sign."""

SUPERMARKET = replace(PAVILION, cornice=0.6, parapet=0.35)
"""A supermarket under a roof that reaches out."""

HALL = Design(
    upper=Facade(bay=3.0),
    sides=Facade(bay=2.6, width=0.0, height=1.0, sill=3.6, inset=0.08, drapes=0.0, boards=False),
    plinth=0.0,
    foot="gates",
    storey=5.0,
    roof="gable",
    pitch=0.16,
)
"""A workshop or warehouse clad in sheet metal, with gates."""

SHED = Design(upper=Facade(bay=1e9), storey=2.2, plinth=0.1, unit=50.0, roof="gable", pitch=0.4)
"""A garage or garden shed without windows."""

_INFILL = replace(SLAB[2], foot="shops", plinth=0.0, ground=3.9, unit=20.0)
ROW_HOUSES = (
    *PERIMETER,
    replace(_EIXAMPLE, roof="gable", pitch=0.68, dormers=False, cornice=0.3, balconies="none"),
    replace(
        _EIXAMPLE,
        upper=replace(_TALL, hood=False, surround=0.1, bay=2.6, width=1.05, height=1.85),
        roof="gable",
        pitch=0.62,
        cornice=0.35,
        ground=4.0,
        storey=3.15,
    ),
    replace(
        _EIXAMPLE,
        upper=replace(_TALL, hood=False, surround=0.0, bay=3.1, width=1.05, shutters=True),
        roof="gable",
        pitch=0.5,
        cornice=0.3,
        ground=3.9,
        storey=3.1,
        balconies="none",
        dormers=False,
    ),
)
"""Plastered houses in closed rows: roofs along the street, mansards, or flat ones."""

ROW_BRICKS = (
    replace(TENEMENT[0], foot="shops", plinth=0.0, ground=4.0, unit=18.0),
    TENEMENT[0],
    TENEMENT[1],
)
"""Brick houses in closed rows."""

ROW_INFILLS = (_INFILL, replace(_INFILL, upper=SLAB[0].upper, balconies="solid"), SLAB[2])
"""What has filled gaps in rows since 1950."""
