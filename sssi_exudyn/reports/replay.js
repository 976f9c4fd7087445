"use strict";
// Draws each ".replay" of the page: skeleton, bending skis, path and forces in perspective, with what the page itself
// holds as data.  Level frame: x down the fall line, y to the left, z up, metres; see sections/replay.py.
(() => {
  const numbers = (text, Kind) => new Kind(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const lerp = (a, b, t) => a + (b - a) * t;
  const VIEWS = { front: [0.5, 0.12], side: [1.571, 0.1], behind: [2.7, 0.3], above: [3.1416, 1.45] };
  const SIDE = ["c2", "c1"]; // the theme's colours of left and right
  const FIELD = 0.7; // rad, height of the picture
  const METRES_PER_WEIGHT = 0.9; // length of an arrow as strong as the skier's weight
  const FILLED = 0.94; // share of the picture that skier and skis fill
  const INSTANTS = 24; // times at which they have to
  const ASIDE = 0.8; // m from the centre of mass to the weight's arrow, which would cover him
  const LIGHT = [0.35, 0.55, -1]; // direction of the light, for shadows
  const STEEPEST = 0.75; // sine of the angle at which a carried pole points down

  class Replay {
    constructor(box) {
      this.box = box;
      this.data = JSON.parse(box.querySelector("script").textContent);
      this.path = numbers(this.data.path, Float32Array);
      this.around = numbers(this.data.around, Int16Array);
      this.forces = numbers(this.data.forces, Int16Array);
      this.heights = this.data.hill && numbers(this.data.hill.heights, Int16Array);
      this.canvas = box.querySelector("canvas");
      this.pen = this.canvas.getContext("2d");
      this.frame = 0; // whole and fraction
      this.speed = 1;
      this.distance = 0; // m; the first picture finds it
      this.shift = 0; // m up the picture from the centre of mass to its middle
      [this.azimuth, this.height] = VIEWS.front;
      this.snow = this.snowLevel();
      this.listen();
      box.querySelector(".controls").hidden = false;
    }

    // Where a point of the frame is, in metres; index counts the packed points.
    point(index) {
      const { points, step, frames } = this.data;
      const first = Math.min(Math.floor(this.frame), frames - 2), t = this.frame - first;
      const a = 3 * (first * points + index), b = a + 3 * points, at = this.com();
      return [0, 1, 2].map((k) => at[k] + step * lerp(this.around[a + k], this.around[b + k], t));
    }

    com(frame = this.frame) {
      const first = Math.min(Math.floor(frame), this.data.frames - 2), t = frame - first;
      return [0, 1, 2].map((k) => lerp(this.path[3 * first + k], this.path[3 * first + 3 + k], t));
    }

    force(index) {
      const { newton, frames } = this.data;
      const first = Math.min(Math.floor(this.frame), frames - 2), t = this.frame - first, a = 3 * (3 * first + index);
      return [0, 1, 2].map((k) => newton * lerp(this.forces[a + k], this.forces[a + 9 + k], t));
    }

    // Height of the snow's plane over the origin, along its normal: the lower foot's median.
    snowLevel() {
      const { inclination, feet, points, step, frames } = this.data;
      const normal = [Math.sin(inclination), Math.cos(inclination)], lower = [];
      for (let i = 0; i < frames; i++) {
        const of = [0, 1].map((side) => {
          const a = 3 * (i * points + feet + side);
          const x = this.path[3 * i] + step * this.around[a], z = this.path[3 * i + 2] + step * this.around[a + 2];
          const y = this.path[3 * i + 1] + step * this.around[a + 1];
          return normal[0] * x + normal[1] * (z - this.hill(x, y));
        });
        lower.push(Math.min(...of));
      }
      return lower.sort((a, b) => a - b)[Math.floor(frames / 2)];
    }

    // Height of the snow straight above its plane.
    hill(x, y) {
      if (!this.heights) return 0;
      const known = this.data.hill, { corner, spacing, rows, columns, step } = known;
      const within = (at, count) => Math.min(Math.max(at / spacing, 0), count - 1 - 1e-9);
      const u = within(x - corner[0], rows), v = within(y - corner[1], columns);
      const i = Math.floor(u), j = Math.floor(v), at = (a, b) => step * this.heights[(i + a) * columns + j + b];
      return lerp(lerp(at(0, 0), at(1, 0), u - i), lerp(at(0, 1), at(1, 1), u - i), v - j);
    }

    onSnow(x, y) {
      const i = this.data.inclination;
      return [x, y, (this.snow - Math.sin(i) * x) / Math.cos(i) + this.hill(x, y)];
    }

    // Screen x, y (CSS pixels), depth (m) and pixels a metre of a place; null behind the camera.
    project(place) {
      const d = place.map((value, k) => value - this.eye[k]);
      const depth = d[0] * this.ahead[0] + d[1] * this.ahead[1] + d[2] * this.ahead[2];
      if (depth < 0.2) return null;
      const scale = this.focal / depth;
      const x = d[0] * this.right[0] + d[1] * this.right[1];
      const y = d[0] * this.up[0] + d[1] * this.up[1] + d[2] * this.up[2];
      return { x: this.width / 2 + scale * x, y: this.tall / 2 - scale * y, depth, scale };
    }

    // Puts the camera as near as shows skier and skis at all times, from the side from which it looks.
    approach() {
      const { frames, points } = this.data, kept = this.frame;
      [this.distance, this.shift] = [5, 0];
      for (let round = 0; round < 8; round++) { // what is nearer looks larger, so that one round is not enough
        let [aside, lowest, highest] = [0, -Infinity, Infinity];
        for (let k = 0; k <= INSTANTS; k++) {
          this.frame = ((frames - 1) * k) / INSTANTS;
          this.look();
          for (let index = 0; index < points; index++) {
            const at = this.project(this.point(index));
            if (at === null) continue;
            aside = Math.max(aside, Math.abs(at.x - this.width / 2));
            [lowest, highest] = [Math.max(lowest, at.y), Math.min(highest, at.y)];
          }
        }
        this.shift -= (((lowest + highest - this.tall) / 2) * this.distance) / this.focal;
        this.distance *= Math.max((2 * aside) / this.width, (lowest - highest) / this.tall) / FILLED;
      }
      this.frame = kept;
    }

    look() {
      const [c, s] = [Math.cos(this.height), Math.sin(this.height)];
      const out = [Math.cos(this.azimuth) * c, Math.sin(this.azimuth) * c, s];
      this.ahead = out.map((value) => -value);
      this.right = [-Math.sin(this.azimuth), Math.cos(this.azimuth), 0];
      this.up = [-Math.cos(this.azimuth) * s, -Math.sin(this.azimuth) * s, c];
      this.eye = this.com().map((value, k) => value + this.shift * this.up[k] + this.distance * out[k]);
      const small = Math.min(this.width, this.tall);
      this.focal = small / (2 * Math.tan(FIELD / 2));
    }

    line(places, colour, width, dash = []) {
      const pen = this.pen;
      pen.strokeStyle = colour;
      pen.lineWidth = width;
      pen.setLineDash(dash);
      pen.beginPath();
      let pending = true;
      for (const place of places) {
        const at = this.project(place);
        if (at === null) pending = true;
        else if (pending) { pen.moveTo(at.x, at.y); pending = false; } else pen.lineTo(at.x, at.y);
      }
      pen.stroke();
      pen.setLineDash([]);
    }

    draw() {
      const ratio = window.devicePixelRatio || 1;
      this.width = this.canvas.clientWidth;
      this.tall = this.canvas.clientHeight;
      if (this.width === 0) return;
      this.canvas.width = Math.round(ratio * this.width);
      this.canvas.height = Math.round(ratio * this.tall);
      const style = getComputedStyle(this.box);
      this.colour = (name) => style.getPropertyValue(`--${name}`).trim();
      this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      this.pen.lineCap = this.pen.lineJoin = "round";
      if (this.distance === 0) this.approach();
      this.look();
      this.drawGround();
      this.drawShadow();
      const drawn = [...this.skis(), ...this.bones(), ...this.poles(), ...this.arrows()];
      const things = drawn.filter((thing) => thing !== null);
      things.sort((a, b) => b.depth - a.depth);
      for (const thing of things) thing.paint();
      this.drawScale();
      this.tell();
    }

    // The slope as snow: cells that fade with their distance, darker where they turn from the light, and lines of equal
    // height, a metre apart.
    drawSnow(x, y, reach) {
      const pen = this.pen, cell = 2, [first, last] = [-reach / cell, reach / cell - 1];
      const [i, j] = [cell * Math.round(x / cell), cell * Math.round(y / cell)];
      for (let a = first; a <= last; a++) {
        for (let b = first; b <= last; b++) {
          const away = Math.hypot((a + 0.5) * cell + i - x, (b + 0.5) * cell + j - y) / reach;
          const corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(
            ([k, l]) => this.project(this.onSnow(i + cell * (a + k), j + cell * (b + l))));
          if (away >= 1 || corners.includes(null)) continue;
          pen.beginPath();
          corners.forEach((at, k) => (k ? pen.lineTo(at.x, at.y) : pen.moveTo(at.x, at.y)));
          pen.fillStyle = this.colour("snow");
          pen.globalAlpha = 1 - away * away;
          pen.fill();
          const [p, q] = [i + cell * (a + 0.5), j + cell * b];
          const down = (this.hill(p + cell, q) - this.hill(p, q)) / cell;
          const aside = (this.hill(p, q + cell) - this.hill(p, q)) / cell;
          const turned = -(LIGHT[0] * down + LIGHT[1] * aside); // from the light, against the plane
          if (turned > 0) {
            pen.fillStyle = this.colour("shade");
            pen.globalAlpha *= Math.min(0.5, 3 * turned);
            pen.fill();
          }
        }
      }
      pen.globalAlpha = 1;
      for (let a = first; a <= last; a++) {
        for (let b = first; b <= last; b++) this.drawContours(i + cell * a, j + cell * b, cell);
      }
    }

    // Lines of equal height over the two triangles of a cell.
    drawContours(x, y, cell) {
      const at = (k, l) => this.onSnow(x + cell * k, y + cell * l);
      for (const corners of [[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]]) {
        const heights = corners.map((corner) => corner[2]);
        for (let z = Math.ceil(Math.min(...heights)); z <= Math.max(...heights); z++) {
          const crossing = [];
          for (let k = 0; k < 3; k++) {
            const [p, q] = [corners[k], corners[(k + 1) % 3]];
            const share = (z - p[2]) / (q[2] - p[2]);
            if ((p[2] < z) !== (q[2] < z)) crossing.push(p.map((value, c) => lerp(value, q[c], share)));
          }
          if (crossing.length === 2) this.line(crossing, this.colour("contour"), z % 5 ? 1 : 2);
        }
      }
    }

    drawGround() {
      const [x, y] = this.com(), reach = 14;
      this.drawSnow(x, y, reach);
      const grid = this.colour("grid"), [i, j] = [Math.round(x), Math.round(y)];
      const steps = Array.from({ length: reach + 1 }, (_, k) => 2 * k - reach); // straight on a plane alone
      for (const k of steps) {
        const down = 2 * Math.round((i + k) / 2), across = 2 * Math.round((j + k) / 2);
        this.line(steps.map((r) => this.onSnow(down, y + r)), grid, 1);
        this.line(steps.map((r) => this.onSnow(x + r, across)), grid, 1);
      }
      const { frames, feet, points, step } = this.data, now = Math.floor(this.frame);
      const every = Math.max(1, Math.round(frames / 600));
      for (const side of [0, 1]) { // tracks of the skis, behind
        const track = [];
        for (let k = 0; k <= now; k += every) {
          const a = 3 * (k * points + feet + side);
          track.push(this.onSnow(this.path[3 * k] + step * this.around[a],
            this.path[3 * k + 1] + step * this.around[a + 1]));
        }
        this.line(track, this.colour(SIDE[side]), 1.2);
      }
      const path = [];
      for (let k = 0; k < frames; k += every) path.push([0, 1, 2].map((c) => this.path[3 * k + c]));
      this.line(path, this.colour("path"), 1.5, [2, 5]);
    }

    // The skier's shadow on the snow, along the light.
    drawShadow() {
      const fallen = (place) => {
        let at = place;
        for (let k = 0; k < 3; k++) { // the snow is nearly flat under a skier
          const above = place[2] - this.onSnow(at[0], at[1])[2];
          at = place.map((value, c) => value - (above * LIGHT[c]) / LIGHT[2]);
        }
        return this.onSnow(at[0], at[1]);
      };
      const strokes = this.data.bones.map(([from, to, half]) => [this.point(from), this.point(to), half]);
      const [neck, crown] = this.data.head.map((index) => this.point(index));
      strokes.push([neck, crown, 0.1], ...this.poleEnds().map(([hand, tip]) => [hand, tip, 0.006]));
      for (const [start, stop, half] of strokes) {
        const [a, b] = [this.project(fallen(start)), this.project(fallen(stop))];
        if (a === null || b === null) continue;
        this.pen.strokeStyle = this.colour("shadow");
        this.pen.lineWidth = Math.max(1, 2 * half * a.scale);
        this.pen.beginPath();
        this.pen.moveTo(a.x, a.y);
        this.pen.lineTo(b.x, b.y);
        this.pen.stroke();
      }
    }

    // Hand and tip of each pole as it is carried, behind the hand and above the snow: no instrument sees poles.
    poleEnds() {
      const f = Math.min(Math.floor(this.frame), this.data.frames - 2), [a, b] = [this.com(f), this.com(f + 1)];
      const course = a.map((value, k) => b[k] - value), far = Math.hypot(...course) || 1;
      return this.data.hands.map((index) => {
        const hand = this.point(index), length = this.data.pole;
        const high = hand[2] - this.onSnow(hand[0], hand[1])[2];
        const sine = Math.min(STEEPEST, Math.max(0, (0.85 * high) / length)), cosine = Math.sqrt(1 - sine * sine);
        const down = [0, 0, -1];
        return [hand, hand.map((value, k) => value + length * (sine * down[k] - (cosine * course[k]) / far))];
      });
    }

    poles() {
      return this.poleEnds().map((ends) => {
        const [a, b] = ends.map((place) => this.project(place));
        if (a === null || b === null) return null;
        return { depth: (a.depth + b.depth) / 2, paint: () => this.line(ends, this.colour("ink"), 1.6) };
      });
    }

    // An arrow of one body weight with its size, below on the left: the measure of all arrows at the skier.
    drawScale() {
      if (!this.box.querySelector("[name=forces]").checked) return;
      const { weight, bodyweight } = this.data, at = this.project(this.com());
      if (at === null) return;
      const long = (at.scale * METRES_PER_WEIGHT * bodyweight) / weight, [x, y] = [14, this.tall - 12];
      const pen = this.pen;
      pen.strokeStyle = pen.fillStyle = this.colour("ink");
      pen.lineWidth = 2;
      pen.beginPath();
      pen.moveTo(x - 5, y);
      pen.lineTo(x + 5, y);
      pen.moveTo(x, y);
      pen.lineTo(x, y - long);
      pen.moveTo(x - 5, y - long);
      pen.lineTo(x + 5, y - long);
      pen.stroke();
      pen.font = "13px system-ui, sans-serif";
      pen.textBaseline = "middle";
      pen.fillText(`1 body weight (${bodyweight.toFixed(0)} N)`, x + 9, y - 4);
    }

    skis() {
      const { skis, stations } = this.data, found = [];
      for (const side of [0, 1]) {
        for (let k = 0; k + 1 < stations; k++) {
          const first = skis + 2 * (side * stations + k);
          const corners = [first, first + 1, first + 3, first + 2].map((index) => this.project(this.point(index)));
          if (corners.includes(null)) continue;
          found.push({
            depth: corners.reduce((sum, c) => sum + c.depth, 0) / 4,
            paint: () => {
              this.pen.beginPath();
              for (const c of corners) this.pen.lineTo(c.x, c.y);
              this.pen.closePath();
              this.pen.fillStyle = this.pen.strokeStyle = this.colour(SIDE[side]);
              this.pen.lineWidth = 1.5;
              this.pen.fill();
              this.pen.stroke();
            },
          });
        }
      }
      return found;
    }

    bones() {
      const stroke = (a, b, half, colour) => (a === null || b === null ? null : {
        depth: (a.depth + b.depth) / 2,
        paint: () => {
          for (const [width, ink] of [[2 * half * a.scale + 2, this.colour("paper")], [2 * half * a.scale, colour]]) {
            this.pen.lineWidth = Math.max(width, 1);
            this.pen.strokeStyle = ink;
            this.pen.beginPath();
            this.pen.moveTo(a.x, a.y);
            this.pen.lineTo(b.x, b.y);
            this.pen.stroke();
          }
        },
      });
      const colours = [this.colour("trunk"), this.colour(SIDE[0]), this.colour(SIDE[1])];
      const found = this.data.bones.map(([from, to, half, side]) =>
        stroke(this.project(this.point(from)), this.project(this.point(to)), half, colours[side]));
      const [neck, crown] = this.data.head.map((index) => this.point(index));
      const along = (share) => this.project(neck.map((value, k) => lerp(value, crown[k], share)));
      const half = 0.36 * Math.hypot(...neck.map((value, k) => value - crown[k]));
      found.push(stroke(along(0.5), along(0.64), half, this.colour("head"))); // a canvas draws no line without length
      return found;
    }

    arrows() {
      if (!this.box.querySelector("[name=forces]").checked) return [];
      const { weight } = this.data, length = METRES_PER_WEIGHT / weight, com = this.com();
      const arrow = (from, force, colour) => {
        const to = from.map((value, k) => value + length * force[k]);
        const [a, b] = [this.project(from), this.project(to)];
        if (a === null || b === null || Math.hypot(b.x - a.x, b.y - a.y) < 3) return null;
        return {
          depth: 0, // painted last: a leg must not hide its force
          paint: () => {
            const turn = Math.atan2(b.y - a.y, b.x - a.x), head = 9;
            this.pen.strokeStyle = this.pen.fillStyle = this.colour(colour);
            this.pen.lineWidth = 3;
            this.pen.beginPath();
            this.pen.moveTo(a.x, a.y);
            this.pen.lineTo(b.x, b.y);
            this.pen.stroke();
            this.pen.beginPath();
            for (const side of [0, 2.6, -2.6]) {
              this.pen.lineTo(b.x + head * Math.cos(turn + side), b.y + head * Math.sin(turn + side));
            }
            this.pen.fill();
          },
        };
      };
      const feet = [0, 1].map((side) => this.point(this.data.feet + side));
      return [
        arrow(feet[0], this.force(0), "c3"),
        arrow(feet[1], this.force(1), "c3"),
        arrow(com, this.force(2), "c4"),
        arrow(com.map((value, k) => value + ASIDE * this.right[k]), [0, 0, -weight], "ink"),
      ];
    }

    tell() {
      const { start, rate, frames, bodyweight } = this.data, f = Math.min(Math.floor(this.frame), frames - 2);
      const [a, b] = [this.com(f), this.com(f + 1)];
      const speed = rate * Math.hypot(...a.map((value, k) => b[k] - value));
      const load = [0, 1].map((index) => Math.hypot(...this.force(index)) / bodyweight);
      const time = `${(start + this.frame / rate).toFixed(2)} s`;
      this.box.querySelector("output").textContent =
        `${time}, ${speed.toFixed(1)} m/s, left ${load[0].toFixed(2)} BW, right ${load[1].toFixed(2)} BW`;
      const slider = this.box.querySelector("[name=time]");
      slider.value = this.frame / (frames - 1);
      slider.setAttribute("aria-valuetext", time);
    }

    play(on) {
      this.playing = on;
      this.box.querySelector("[name=play]").textContent = on ? "Pause" : "Play";
      if (!on) return;
      const last = this.data.frames - 1;
      if (this.frame >= last) this.frame = 0;
      let before = performance.now();
      const next = (now) => {
        if (!this.playing) return;
        this.frame = Math.min(last, this.frame + (this.speed * this.data.rate * Math.max(0, now - before)) / 1000);
        before = now;
        this.draw();
        if (this.frame >= last) this.play(false);
        else requestAnimationFrame(next);
      };
      requestAnimationFrame(next);
    }

    turn(azimuth, height) {
      this.azimuth += azimuth;
      this.height = Math.min(1.55, Math.max(-0.2, this.height + height));
      this.draw();
    }

    zoom(factor) {
      this.distance = Math.min(60, Math.max(1.5, this.distance * factor));
      this.draw();
    }

    listen() {
      const control = (name) => this.box.querySelector(`[name=${name}]`), held = new Map();
      control("play").addEventListener("click", () => this.play(!this.playing));
      control("time").addEventListener("input", (event) => {
        this.play(false);
        this.frame = event.target.value * (this.data.frames - 1);
        this.draw();
      });
      control("speed").addEventListener("change", (event) => { this.speed = Number(event.target.value); });
      control("forces").addEventListener("change", () => this.draw());
      control("view").addEventListener("change", (event) => {
        [this.azimuth, this.height] = VIEWS[event.target.value];
        this.distance = 0;
        this.draw();
      });
      control("nearer").addEventListener("click", () => this.zoom(0.8));
      control("farther").addEventListener("click", () => this.zoom(1.25));
      const canvas = this.canvas;
      canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        held.set(event.pointerId, [event.clientX, event.clientY]);
      });
      canvas.addEventListener("pointermove", (event) => {
        const old = held.get(event.pointerId);
        if (old === undefined) return;
        const apart = () => {
          const [a, b] = [...held.values()];
          return Math.hypot(a[0] - b[0], a[1] - b[1]);
        };
        const before = held.size === 2 ? apart() : 0;
        held.set(event.pointerId, [event.clientX, event.clientY]);
        if (held.size === 2) this.zoom(before / Math.max(apart(), 1));
        else this.turn((old[0] - event.clientX) / 150, (event.clientY - old[1]) / 150);
      });
      for (const end of ["pointerup", "pointercancel"]) {
        canvas.addEventListener(end, (event) => held.delete(event.pointerId));
      }
      canvas.addEventListener("wheel", (event) => { // a pinch on a touchpad; a plain wheel scrolls the page
        if (!event.ctrlKey) return;
        event.preventDefault();
        this.zoom(Math.exp(event.deltaY / 100));
      }, { passive: false });
      canvas.addEventListener("keydown", (event) => {
        const by = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
        if (by !== undefined) this.turn(...by);
        else if (event.key === " ") this.play(!this.playing);
        else return;
        event.preventDefault();
      });
      new ResizeObserver(() => this.draw()).observe(canvas);
      window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    }
  }

  // Several runs played as one: the same time since each run's start.
  function playTogether(box, players) {
    const button = box.querySelector("button"), slider = box.querySelector("input");
    const longest = Math.max(...players.map(({ data }) => (data.frames - 1) / data.rate));
    let seconds = 0, playing = false;
    const show = () => {
      for (const each of players) {
        each.frame = Math.min(each.data.frames - 1, seconds * each.data.rate);
        each.draw();
      }
      slider.value = seconds / longest;
      slider.setAttribute("aria-valuetext", `${seconds.toFixed(2)} s since each start`);
    };
    const stop = () => {
      playing = false;
      button.textContent = "Play together";
    };
    button.addEventListener("click", () => {
      if (playing) return stop();
      for (const each of players) each.play(false);
      if (seconds >= longest) seconds = 0;
      playing = true;
      button.textContent = "Pause both";
      let before = performance.now();
      const next = (now) => {
        if (!playing) return;
        seconds = Math.min(longest, seconds + (players[0].speed * Math.max(0, now - before)) / 1000);
        before = now;
        show();
        if (seconds >= longest) stop();
        else requestAnimationFrame(next);
      };
      requestAnimationFrame(next);
    });
    slider.addEventListener("input", () => {
      stop();
      seconds = slider.value * longest;
      show();
    });
    box.hidden = false;
  }

  const players = [...document.querySelectorAll(".replay")].map((box) => new Replay(box));
  for (const box of document.querySelectorAll(".together")) playTogether(box, players);
})();
