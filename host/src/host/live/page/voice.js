// Spoken words, after a person has switched them on. Only a voice of this computer speaks: others
// would send the words to somebody else's.

const SPOKEN = { m: "metres", s: "seconds", deg: "degrees", "%": "per cent" };

export function spoken(text) {
  return text.replace(/(\d) (m|s|deg|%)(?![\w])/g, (_, digit, unit) => `${digit} ${SPOKEN[unit]}`);
}

export class Voice {
  constructor(button, synthesis = window.speechSynthesis) {
    this.synthesis = synthesis;
    this.button = button;
    this.on = false;
    this.last = "";
    button.addEventListener("click", () => this.toggle());
  }

  // A voice may come late: it is looked for each time.
  own() {
    const voices = (this.synthesis?.getVoices() ?? []).filter((voice) => voice.localService);
    return voices.find((voice) => voice.lang.startsWith("en")) ?? null;
  }

  toggle() {
    this.on = !this.on;
    this.button.textContent = !this.on ? "Voice off" : this.own() ? "Voice on" : "No voice here";
    this.button.setAttribute("aria-pressed", String(this.on));
    if (this.on) this.say("voice on");
    else this.synthesis?.cancel();
  }

  say(text) {
    const voice = this.on && text ? this.own() : null;
    if (voice === null) return;
    this.synthesis.cancel(); // what is new counts
    const words = new SpeechSynthesisUtterance(spoken(text));
    words.voice = voice;
    words.lang = voice.lang;
    this.synthesis.speak(words);
  }

  // Says what begins to hold, once: its figures may go on changing.
  tell(text) {
    const kind = text.replace(/[\d.]+/g, "");
    if (kind !== this.last) this.say(text);
    this.last = kind;
  }
}
