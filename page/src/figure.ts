// A person of bones, drawn by three.js. One renderer draws all of them, one after the other, into their own canvases:
// browsers allow few WebGL contexts, and a page may show twelve bodies.

import {
  CapsuleGeometry,
  CircleGeometry,
  Color,
  DirectionalLight,
  Group,
  HemisphereLight,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  Object3D,
  PerspectiveCamera,
  Quaternion as Turn,
  Scene,
  SphereGeometry,
  Vector3,
  WebGLRenderer,
} from "three";
import { colour } from "./elements.ts";
import type { Level, Point, Quaternion, WatchStarted } from "./messages.ts";

const BONE_RADIUS_M = 0.038;
const HEAD_RADIUS_M = 0.105;
const UP = new Vector3(0, 1, 0);

export interface Looks {
  readonly pose: readonly Quaternion[];
  readonly observed: readonly boolean[];
  readonly level: Level | null;
  /** Radians about the body's up, 0 from the front. */
  readonly angle: number;
}

export class Figure {
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(28, 1, 0.1, 20);
  readonly #joints: Object3D[] = [];
  readonly #bones: Mesh[][] = [];
  readonly #solid = new MeshStandardMaterial({ roughness: 0.65 });
  readonly #ghost = new MeshStandardMaterial({ roughness: 0.65, transparent: true, opacity: 0.28, depthWrite: false });
  readonly #floor = new MeshBasicMaterial({ transparent: true, opacity: 0.5 });

  /** Throws where the browser has no WebGL. */
  constructor(started: WatchStarted) {
    this.#renderer = new WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(1.5, 3, 2.5);
    this.#scene.add(new HemisphereLight(0xffffff, 0x667077, 1.6), sun, this.#ground(), this.#build(started));
  }

  draw(canvas: HTMLCanvasElement, looks: Looks): void {
    const ratio = Math.min(devicePixelRatio, 2);
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    const plane = canvas.getContext("2d");
    if (!plane || !width || !height) return;
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    this.#pose(looks);
    this.#renderer.setSize(width, height, false);
    this.#aim(width / height, looks.angle);
    this.#renderer.render(this.#scene, this.#camera);
    plane.clearRect(0, 0, width, height);
    plane.drawImage(this.#renderer.domElement, 0, 0);
  }

  #pose({ pose, observed, level }: Looks): void {
    const paint = new Color(colour(level ?? "still"));
    this.#solid.color.copy(paint);
    this.#ghost.color.copy(paint);
    this.#floor.color.set(colour("line"));
    this.#joints.forEach((joint, at) => {
      const turn = pose[at];
      if (turn) joint.quaternion.set(...(turn as [number, number, number, number])).normalize();
      for (const bone of this.#bones[at] ?? []) bone.material = observed[at] ? this.#solid : this.#ghost;
    });
  }

  #aim(aspect: number, angle: number): void {
    const away = Math.max(4.3, 2.6 / aspect);
    this.#camera.aspect = aspect;
    this.#camera.position.set(away * Math.sin(angle), 1.25, away * Math.cos(angle));
    this.#camera.lookAt(0, 0.95, 0);
    this.#camera.updateProjectionMatrix();
  }

  #ground(): Mesh {
    const ground = new Mesh(new CircleGeometry(0.55, 48), this.#floor);
    ground.rotation.x = -Math.PI / 2;
    return ground;
  }

  /** The tree of joints; what a joint carries turns with it. */
  #build({ parents, offsets, tips, pelvis }: WatchStarted): Group {
    const root = new Group();
    root.position.set(...(pelvis as [number, number, number]));
    parents.forEach((parent, at) => {
      const joint = new Object3D();
      joint.position.set(...((offsets[at] ?? [0, 0, 0]) as [number, number, number]));
      (this.#joints[parent] ?? root).add(joint);
      this.#joints.push(joint);
      this.#bones.push([this.#ball(joint, BONE_RADIUS_M * 1.15)]);
    });
    parents.forEach((parent, at) => this.#connect(this.#joints[parent] ?? root, parent, offsets[at] ?? [0, 0, 0]));
    tips.forEach((tip, at) => {
      const joint = this.#joints[at];
      if (tip && joint) this.#end(joint, at, tip);
    });
    return root;
  }

  #connect(from: Object3D, owner: number, offset: Point): void {
    const [x, y, z] = offset;
    // Shoulders hang on a crossbar at their height, not on the middle of the chest.
    const bones = x !== 0 && y > 0 ? [this.#bone(from, [x, 0, 0], [0, y, z])] : [this.#bone(from, offset)];
    this.#bones[owner]?.push(...bones);
  }

  #end(joint: Object3D, at: number, tip: Point): void {
    if (tip[1] < 0) {
      this.#bones[at]?.push(this.#bone(joint, tip));
      return;
    }
    const head = this.#ball(joint, HEAD_RADIUS_M);
    head.position.set(tip[0], tip[1] / 2, tip[2]);
    head.scale.set(0.85, 1.15, 1);
    const nose = this.#ball(joint, 0.022);
    nose.position.set(0, tip[1] / 2 - 0.01, HEAD_RADIUS_M);
    this.#bones[at]?.push(head, nose);
  }

  #bone(from: Object3D, to: Point, start: Point = [0, 0, 0]): Mesh {
    const along = new Vector3(...(to as [number, number, number]));
    const bone = new Mesh(new CapsuleGeometry(BONE_RADIUS_M, along.length(), 6, 14), this.#solid);
    bone.position.copy(along).multiplyScalar(0.5).add(new Vector3(...(start as [number, number, number])));
    bone.quaternion.setFromUnitVectors(UP, along.clone().normalize());
    from.add(bone);
    return bone;
  }

  #ball(from: Object3D, radius: number): Mesh {
    const ball = new Mesh(new SphereGeometry(radius, 20, 14), this.#solid);
    from.add(ball);
    return ball;
  }
}

const one = new Turn();
const other = new Turn();

/** The pose a share of the way from one to another, by the shortest turn of each joint. */
export function between(from: readonly Quaternion[], to: readonly Quaternion[], share: number): Quaternion[] {
  return to.map((goal, at) => {
    const start = from[at];
    if (!start) return goal;
    one.set(...(start as [number, number, number, number]));
    other.set(...(goal as [number, number, number, number]));
    one.slerp(other, share);
    return [one.x, one.y, one.z, one.w];
  });
}
