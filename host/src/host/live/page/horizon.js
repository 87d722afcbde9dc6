// Artificial horizon: the world tilts, the aircraft stays. Drawn for sunlight: dark line, pale halves.

const SKY = "#cfe3ff";
const GROUND = "#e3cfae";
const PER_DEG = 1 / 60; // of the height: 60 deg of pitch from top to bottom
const LADDER_DEG = [-20, -10, 10, 20];
const ROLL_DEG = [-60, -30, 0, 30, 60];

export class Horizon {
  constructor(canvas) {
    this.canvas = canvas;
  }

  draw(roll, pitch) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    const dots = window.devicePixelRatio || 1;
    if (this.canvas.width !== Math.round(width * dots) || this.canvas.height !== Math.round(height * dots)) {
      this.canvas.width = Math.round(width * dots);
      this.canvas.height = Math.round(height * dots);
    }
    const pen = this.canvas.getContext("2d");
    pen.setTransform(dots, 0, 0, dots, 0, 0);
    pen.clearRect(0, 0, width, height);
    if (roll === null || pitch === null) return;
    pen.save();
    pen.translate(width / 2, height / 2);
    pen.rotate((-roll * Math.PI) / 180);
    this.world(pen, height, pitch);
    this.bank(pen, height);
    pen.restore();
    this.wings(pen, width, height);
  }

  world(pen, height, pitch) {
    const perDeg = height * PER_DEG;
    const level = Math.max(-90, Math.min(90, pitch)) * perDeg;
    const far = 2 * height;
    pen.fillStyle = SKY;
    pen.fillRect(-far, -far, 2 * far, far + level);
    pen.fillStyle = GROUND;
    pen.fillRect(-far, level, 2 * far, far + Math.abs(level));
    pen.strokeStyle = "#000";
    pen.lineWidth = 2;
    pen.beginPath();
    pen.moveTo(-far, level);
    pen.lineTo(far, level);
    pen.stroke();
    pen.lineWidth = 1;
    pen.beginPath();
    for (const degrees of LADDER_DEG) {
      const at = level - degrees * perDeg;
      pen.moveTo(-12, at);
      pen.lineTo(12, at);
    }
    pen.stroke();
  }

  // Marks of bank at the rim; they turn with the world, the wings' pointer does not.
  bank(pen, height) {
    const rim = height / 2 - 3;
    pen.lineWidth = 2;
    pen.beginPath();
    for (const degrees of ROLL_DEG) {
      const angle = ((degrees - 90) * Math.PI) / 180;
      const [x, y] = [Math.cos(angle), Math.sin(angle)];
      pen.moveTo(x * rim, y * rim);
      pen.lineTo(x * (rim - 7), y * (rim - 7));
    }
    pen.stroke();
  }

  wings(pen, width, height) {
    const [x, y] = [width / 2, height / 2];
    pen.strokeStyle = pen.fillStyle = "#c43b00";
    pen.lineWidth = 4;
    pen.beginPath();
    pen.moveTo(x - 34, y);
    pen.lineTo(x - 12, y);
    pen.lineTo(x, y + 9);
    pen.lineTo(x + 12, y);
    pen.lineTo(x + 34, y);
    pen.stroke();
    pen.beginPath();
    pen.moveTo(x, 10);
    pen.lineTo(x - 6, 20);
    pen.lineTo(x + 6, 20);
    pen.fill();
  }
}
