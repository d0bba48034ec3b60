// Sources of a run's data: the report file itself, or the server that the page came from.

/** The data inside a report file; `boot.js` unpacks it. */
class FileSource {
  constructor() {
    this.live = false;
  }

  async json(name) {
    return JSON.parse(new TextDecoder().decode(await unpackedPart(name)));
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

  async block(kind, part) {
    return new Block(await unpackedPart(`${kind}-${part}`));
  }

  /** Calls `announce` once with the number of parts. */
  follow(announce) {
    announce({ sealed: document.querySelectorAll('script[data-part^="overview-"]').length, open: 0, done: true });
  }

  /** Loads the chart script. */
  async charts() {
    const url = URL.createObjectURL(new Blob([await unpackedPart("charts")], { type: "text/javascript" }));
    return script(url);
  }
}

/** The data on the server that the page came from. */
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

  async block(kind, part) {
    return new Block(new Uint8Array(await (await this.fetched(`${kind}/${part}`)).arrayBuffer()));
  }

  /**
   * Calls `announce` with the amount of data, now and whenever it changes: the number of complete parts, the number of time
   * steps of the growing part, and whether the data is complete. Calls `lost` and reconnects if the connection is interrupted.
   */
  follow(announce, lost, pause_ms = 500) {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(`${scheme}//${location.host}${this.base}/feed`);
    let done = false;
    socket.onmessage = (message) => {
      const state = JSON.parse(message.data);
      done = state.done;
      pause_ms = 500;
      announce(state);
      // A page that has all data frees its connection for others.
      if (done) socket.close();
    };
    socket.onclose = () => {
      if (done) return;
      lost();
      setTimeout(() => this.follow(announce, lost, Math.min(2 * pause_ms, 8000)), pause_ms);
    };
  }

  async charts() {
    return script("/plotly.js");
  }
}

/** Loads and runs a script. */
function script(url) {
  return new Promise((resolve, reject) => {
    const element = document.createElement("script");
    element.src = url;
    element.onload = resolve;
    element.onerror = () => reject(new Error("the chart script did not load"));
    document.head.append(element);
  });
}
