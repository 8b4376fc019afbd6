/*
 * While the camera moves, fewer pixels and then fewer triangles, and only where whole frames were measured to be
 * slow; full quality again at rest. A frame is measured from its submission until the graphics driver is done.
 */

const DETAILS = [{ pixels: 1, coarse: false }, { pixels: 0.5, coarse: false }, { pixels: 0.5, coarse: true }];
const SLOW_FRAME = 50, REST_AFTER = 220; // ms

class Motion {
  constructor(gl, redraw) {
    Object.assign(this, { gl, redraw, level: 0, slow: 0, moving: false, fence: null });
  }

  /** What to draw with now. */
  get detail() {
    return DETAILS[this.moving ? this.level : 0];
  }

  /** The camera was moved by hand: stay coarse until it rests. */
  stir() {
    this.moving = true;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.moving = false;
      if (this.level) this.redraw();
    }, REST_AFTER);
  }

  /** Whether the driver still works on the last frame; another one would only queue up. */
  get busy() {
    return this.fence !== null;
  }

  /** Follow the frame just drawn until it is done. */
  submitted() {
    const gl = this.gl;
    if (this.fence) gl.deleteSync(this.fence);
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0), since = performance.now(), moving = this.moving;
    this.fence = fence;
    gl.flush();
    const ask = () => {
      if (this.fence !== fence) return;
      if (!gl.isContextLost() && gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED) {
        setTimeout(ask, 4);
        return;
      }
      gl.deleteSync(fence);
      this.fence = null;
      if (!document.hidden) this.learn(performance.now() - since, moving);
    };
    setTimeout(ask, 0);
  }

  /** Two slow frames running lower the detail of motion; a fast one at rest, drawn in full, restores it. */
  learn(time, moving) {
    if (!moving && this.level) {
      if (time < SLOW_FRAME / 2) this.level = 0;
      return;
    }
    this.slow = time > SLOW_FRAME ? this.slow + 1 : 0;
    if (this.slow < 2 || this.level === DETAILS.length - 1) return;
    this.level = Math.min(this.level + (time > 4 * SLOW_FRAME ? 2 : 1), DETAILS.length - 1);
    this.slow = 0;
  }
}
