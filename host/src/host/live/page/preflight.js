// The preflight's list: what is green, what is asked for now, and why not. Texts are set as text.

const byId = (id) => document.getElementById(id);
const MARKS = { seen: "\u2713", failed: "\u2717", waiting: "" };
const WORDS = { seen: "ok", failed: "not ok", waiting: "waits" };

export class Preflight {
  constructor(ask, sound) {
    this.ask = ask;
    this.sound = sound;
    this.states = new Map();
    this.shown = "";
    this.mayAsk = false;
    byId("preflight-next").addEventListener("click", () => ask({ do: "next" }));
    byId("preflight-end").addEventListener("click", () => ask({ do: "end" }));
  }

  allow(mayAsk) {
    this.mayAsk = mayAsk;
    this.shown = "";
  }

  show(said) {
    const open = said !== null && said.items.length > 0 && !(said.ended && said.go);
    document.body.classList.toggle("preflight", open);
    byId("preflight").hidden = !open;
    const text = JSON.stringify(said);
    if (!open || text === this.shown) return;
    this.shown = text;
    this.#sound(said.items);
    this.#asked(said);
    const focused = document.activeElement?.dataset?.item;
    const rows = said.items.map((item) => this.#row(item));
    byId("preflight-items").replaceChildren(...rows);
    if (focused) document.querySelector(`[data-item="${CSS.escape(focused)}"]`)?.focus();
    const now = rows.find((row) => row.classList.contains("asked"));
    if (now) now.scrollIntoView({ block: "nearest" });
  }

  // The pilot stands at the aircraft: high is seen, low is not.
  #sound(items) {
    const news = items.filter((item) => this.states.get(item.key) === "waiting" && item.state !== "waiting");
    if (news.some((item) => item.state === "failed")) this.sound.play([330, 330]);
    else if (news.length) this.sound.play([880]);
    this.states = new Map(items.map((item) => [item.key, item.state]));
  }

  #asked(said) {
    const item = said.items.find((one) => one.asked);
    const still = "still and level, hands off, transmitter on, pitots covered from the wind";
    const step = said.ended ? `${said.go ? "GO" : "NO-GO"}: ${said.sheet}` : item ? item.step : still;
    this.#set("preflight-title", said.ended ? "ended" : item ? item.title : "leave the aircraft alone");
    this.#set("preflight-step", step);
    this.#set("preflight-seen", item ? item.reason : "");
    byId("preflight-next").hidden = !this.mayAsk || said.ended;
    byId("preflight-end").hidden = !this.mayAsk || said.ended;
  }

  #set(id, text) {
    if (byId(id).textContent !== text) byId(id).textContent = text;
  }

  #row(item) {
    const row = document.createElement("li");
    row.className = item.asked && item.state === "waiting" ? "asked" : item.state;
    const mark = document.createElement("b");
    mark.textContent = MARKS[item.state];
    mark.setAttribute("role", "img");
    mark.setAttribute("aria-label", WORDS[item.state]);
    const title = document.createElement("span");
    title.textContent = item.title;
    row.append(mark, title);
    if (this.mayAsk && item.state === "failed") row.append(this.#again(item));
    if (item.state === "failed" && item.reason) {
      const reason = document.createElement("p");
      reason.textContent = item.reason;
      row.append(reason);
    }
    return row;
  }

  #again(item) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = "again";
    button.dataset.item = item.key;
    button.setAttribute("aria-label", `again: ${item.title}`);
    button.addEventListener("click", () => this.ask({ do: "again", item: item.key }));
    return button;
  }
}
