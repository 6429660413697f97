from dataclasses import dataclass

from feelahead.lab.pieces import Piece


@dataclass(frozen=True)
class Cell:
    scene: str
    sizes: tuple[int, int]


def test_a_piece_is_named_by_the_scalars_of_its_cell() -> None:
    piece = Piece(Cell("wall", (25, 8)), 3)
    assert piece.columns == {"scene": "wall", "seed": 3}
    assert str(piece) == "scene wall, seed 3"
    assert "25" in piece.key
