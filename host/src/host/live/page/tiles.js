// Pictures of the ground below the track: web-map tiles of `--tiles`, placed around home.

const EQUATOR_M = 40075016.7;
const TILE = 256; // pixels
const MOST = 60; // of a view
const KEPT = 300;

export class Tiles {
  constructor() {
    this.zooms = null; // least and largest; null without a map
    this.home = null; // latitude and longitude, deg
    this.pictures = new Map();
  }

  // `place` is the plan's: pixels per metre, and where metres east and north of home lie.
  draw(pen, place, width, height) {
    if (!this.zooms || !this.home) return;
    const [latitude, longitude] = this.home;
    const round = EQUATOR_M * Math.cos((latitude * Math.PI) / 180);
    const wanted = Math.round(Math.log2((round * place.perM) / TILE));
    const zoom = Math.max(this.zooms[0], Math.min(this.zooms[1], wanted));
    const side = round / 2 ** zoom; // of a tile, m
    const [x, y] = tileOf(latitude, longitude, zoom);
    const [left, top] = place.at(0, 0).map((pixel) => -pixel / place.perM / side);
    const [first, last] = [Math.floor(x + left), Math.floor(x + left + width / place.perM / side)];
    const [north, south] = [Math.floor(y + top), Math.floor(y + top + height / place.perM / side)];
    if ((last - first + 1) * (south - north + 1) > MOST) return;
    pen.globalAlpha = 0.6; // the track stays darker
    for (let column = first; column <= last; column += 1) {
      for (let row = north; row <= south; row += 1) {
        const picture = this.picture(zoom, column, row);
        const [at, down] = place.at((column - x) * side, (y - row) * side);
        if (picture) pen.drawImage(picture, at, down, side * place.perM + 0.5, side * place.perM + 0.5);
      }
    }
    pen.globalAlpha = 1;
  }

  // One that is there; else asks for it, once.
  picture(zoom, column, row) {
    const name = `tiles/${zoom}/${column}/${row}`;
    if (row < 0 || column < 0) return null;
    let picture = this.pictures.get(name);
    if (!picture) {
      if (this.pictures.size >= KEPT) this.pictures.clear();
      picture = new Image();
      picture.src = name;
      this.pictures.set(name, picture);
    }
    return picture.complete && picture.naturalWidth ? picture : null;
  }
}

// Column and row of a place, with their parts (Mercator, rows from north).
export function tileOf(latitude, longitude, zoom) {
  const angle = (latitude * Math.PI) / 180;
  const down = (1 - Math.asinh(Math.tan(angle)) / Math.PI) / 2;
  return [((longitude + 180) / 360) * 2 ** zoom, down * 2 ** zoom];
}
