// Tones, after a person has switched them on once: browsers allow no sound before.

export class Sound {
  constructor(button) {
    this.context = null;
    this.button = button;
    button.addEventListener("click", () => this.toggle());
  }

  toggle() {
    if (this.context === null) this.context = new AudioContext();
    else {
      this.context.close();
      this.context = null;
    }
    const on = this.context !== null;
    this.button.textContent = on ? "Sound on" : "Sound off";
    this.button.setAttribute("aria-pressed", String(on));
    if (on) this.play([880]);
  }

  play(tonesHz) {
    if (this.context === null) return;
    tonesHz.forEach((tone, at) => {
      const start = this.context.currentTime + 0.14 * at;
      const source = this.context.createOscillator();
      const level = this.context.createGain();
      source.frequency.value = tone;
      level.gain.setValueAtTime(0.25, start);
      level.gain.exponentialRampToValueAtTime(0.01, start + 0.12);
      source.connect(level).connect(this.context.destination);
      source.start(start);
      source.stop(start + 0.13);
    });
  }
}
