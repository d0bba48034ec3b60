// Where a run's data comes from: the file that the page is, or the server that it came from.

/** The data inside a report. */
class FileSource {
  constructor() {
    this.live = false;
  }

  async bytes(name) {
    const text = document.querySelector(`script[data-part="${name}"]`).textContent;
    return inflate(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));
  }

  async json(name) {
    return JSON.parse(new TextDecoder().decode(await this.bytes(name)));
  }

  async head() {
    return this.json("head");
  }

  async batch() {
    return this.json("batch");
  }

  async map() {
    return this.json("map");
  }

  async half(kind, part) {
    return new Half(await this.bytes(`${kind}-${part}`));
  }

  /** Tells once how much there is. */
  follow(told) {
    told({ sealed: document.querySelectorAll('script[data-part^="overview-"]').length, open: 0, done: true });
  }

  async charts() {
    const url = URL.createObjectURL(new Blob([await this.bytes("charts")], { type: "text/javascript" }));
    return script(url);
  }
}

/** Data from the server that the page came from. */
class ServedSource {
  constructor(base) {
    this.base = base;
    this.live = true;
  }

  async fetched(path) {
    const answer = await fetch(`${this.base}/${path}`);
    if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
    return answer;
  }

  async head() {
    return (await this.fetched("head.json")).json();
  }

  async batch() {
    return (await this.fetched("batch.json")).json();
  }

  async map() {
    return (await this.fetched("map.json")).json();
  }

  async half(kind, part) {
    return new Half(new Uint8Array(await (await this.fetched(`${kind}/${part}`)).arrayBuffer()));
  }

  /**
   * Tells how much there is, now and whenever that changes: how many parts will not change any more, how many instants
   * the part after them has so far, and whether that was all. Goes on after an interruption, of which `lost` is told.
   */
  follow(told, lost, pause_ms = 500) {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(`${scheme}//${location.host}${this.base}/feed`);
    let done = false;
    socket.onmessage = (message) => {
      const state = JSON.parse(message.data);
      done = state.done;
      pause_ms = 500;
      told(state);
      // A page that knows all leaves its place to others.
      if (done) socket.close();
    };
    socket.onclose = () => {
      if (done) return;
      lost();
      setTimeout(() => this.follow(told, lost, Math.min(2 * pause_ms, 8000)), pause_ms);
    };
  }

  async charts() {
    return script("/plotly.js");
  }
}

/** Runs another script. */
function script(url) {
  return new Promise((resolve, reject) => {
    const element = document.createElement("script");
    element.src = url;
    element.onload = resolve;
    element.onerror = () => reject(new Error("the charts' script did not load"));
    document.head.append(element);
  });
}
