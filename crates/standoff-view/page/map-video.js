// A video of the map: the browser records it while the run is played.

/** Frames per second of a video. */
const VIDEO_RATE = 30;
/** Types of videos, the first of which that the browser records is used: type, name and file ending. */
const VIDEO_TYPES = [["video/mp4", "MP4", "mp4"], ["video/webm", "WebM", "webm"]];

class MapVideo {
  constructor(page) {
    this.page = page;
    this.button = element("map-video");
    this.recorder = null;
    const canRecord = typeof MediaRecorder !== "undefined" && Boolean(HTMLCanvasElement.prototype.captureStream);
    const type = canRecord && VIDEO_TYPES.find(([type]) => MediaRecorder.isTypeSupported(type));
    [this.type, this.typeName, this.ending] = type || [];
    this.button.hidden = !type;
    this.label(`Video (${this.typeName})`);
    this.button.addEventListener("click", () => (this.recorder ? this.stop() : this.start()));
  }

  /** Plays the time range of the charts, or the whole run, at the selected speed, and records the map. */
  start() {
    const { clock, charts, map } = this.page;
    const [from_s, to_s] = charts.shown_s;
    this.until_s = Math.min(to_s, clock.replayData.end_s);
    this.name = `${exportName(this.page)}.${this.ending}`;
    this.canvas = document.createElement("canvas");
    const ratio = screenRatio();
    // Encoders need even sizes.
    [this.canvas.width, this.canvas.height] = [map.camera.width, map.camera.height + CAPTION_HEIGHT].map((side) => 2 * Math.round((side * ratio) / 2));
    const pieces = [];
    this.recorder = new MediaRecorder(this.canvas.captureStream(VIDEO_RATE), { mimeType: this.type, videoBitsPerSecond: 8e6 });
    this.recorder.addEventListener("dataavailable", ({ data }) => pieces.push(data));
    this.recorder.addEventListener("stop", () => save(this.name, new Blob(pieces), this.type), { once: true });
    clock.seek(from_s);
    this.frame();
    this.recorder.start();
    clock.play();
    this.label("Stop video");
  }

  /** Ends the recording and saves the video. */
  stop() {
    this.recorder.stop();
    this.recorder = null;
    this.page.clock.pause();
    this.label(`Video (${this.typeName})`);
  }

  label(text) {
    this.button.textContent = text;
    this.button.setAttribute("aria-pressed", String(Boolean(this.recorder)));
  }

  /** Adds the map as it is drawn, with a caption; ends the recording at the end of the time range, or when the run is paused. */
  frame() {
    if (!this.recorder) return;
    const { map, clock, replayData } = this.page;
    const ctx = this.canvas.getContext("2d", { alpha: false });
    const ratio = screenRatio();
    const height = map.camera.height * ratio;
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.fillStyle = palette().ground;
    ctx.fillRect(0, 0, this.canvas.width, this.canvas.height);
    ctx.drawImage(map.canvas, 0, 0);
    ctx.setTransform(ratio, 0, 0, ratio, 0, height);
    drawCaption(ctx, map.camera.width, 0, runName(replayData.head), clock.time_s);
    if (clock.time_s >= this.until_s || (this.wasPlaying && !clock.playing)) this.stop();
    this.wasPlaying = clock.playing;
  }
}
