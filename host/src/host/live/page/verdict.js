// Verdict of the last test point, and what is next on the card with its countdown.

const byId = (id) => document.getElementById(id);
const TICKS_S = [3, 2, 1];
const GOOD_HZ = [660, 880];
const REPEAT_HZ = [300, 300, 300];
const TICK_HZ = [880];
const NOW_HZ = [1320];

function set(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}

export class Verdict {
  constructor(sound, voice) {
    this.sound = sound;
    this.voice = voice;
    this.number = null; // of the last verdict heard of; null before the first state
    this.left = null;
  }

  show(said) {
    byId("point").hidden = said === null;
    if (said === null) return;
    this.last(said.verdicts.length ? said.verdicts[said.verdicts.length - 1] : null, said.next);
    this.next(said.next);
  }

  last(verdict, next) {
    const box = byId("point-verdict");
    const kind = verdict === null ? "" : verdict.good ? "good" : "bad";
    if (box.className !== kind) box.className = kind;
    set("point-words", verdict === null ? "no test point yet" : verdict.text);
    set("point-which", verdict === null ? "" : `point ${verdict.point}`);
    const number = verdict === null ? 0 : verdict.number;
    if (this.number !== null && number > this.number) {
      this.sound.play(verdict.good ? GOOD_HZ : REPEAT_HZ);
      this.voice.say(next === null ? verdict.text : `${verdict.text}. next: ${next.text}`);
    }
    this.number = number;
  }

  next(next) {
    if (next === null) {
      set("point-next", "the card is through");
      set("point-in", "");
      return;
    }
    const before = next.before ? `${next.before}, then ` : "";
    set("point-next", `${next.number} of ${next.of}: ${before}${next.text}`);
    const left = next.in_s === null ? null : Math.ceil(next.in_s);
    set("point-in", left === null ? "" : left > 0 ? `in ${left} s` : "now");
    if (left !== null && this.left !== null && left < this.left) {
      if (left === 0) this.sound.play(NOW_HZ);
      else if (TICKS_S.includes(left)) this.sound.play(TICK_HZ);
    }
    this.left = left;
  }
}
