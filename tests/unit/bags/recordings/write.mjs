// bags tests - writes drive.csv as JSON messages with @mcap/core; write.py says how to run it.
import { McapWriter } from "@mcap/core";
import { readFileSync, writeFileSync } from "node:fs";

const STAMP = 1700000000123456789n;
const rows = readFileSync(new URL("drive.csv", import.meta.url), "utf8").trim().split("\n").slice(1).map((line) => line.split(",").map(Number));

const pieces = [];
let size = 0n;
const writer = new McapWriter({
  writable: {
    write: async (piece) => { pieces.push(piece.slice()); size += BigInt(piece.length); },
    position: () => size,
  },
  chunkSize: 16384,
});
await writer.start({ profile: "", library: "armcal tests" });
const schemaId = await writer.registerSchema({ name: "Robot", encoding: "jsonschema", data: new TextEncoder().encode('{"type": "object"}') });
const channelId = await writer.registerChannel({ schemaId, topic: "robot", messageEncoding: "json", metadata: new Map() });
for (const [k, [t, q1, q2, q3, tau1, tau2, tau3]] of rows.entries()) {
  const stamp = STAMP + BigInt(Math.round(1e9 * (t - rows[0][0])));
  const message = {
    header: { stamp: { sec: Number(stamp / 1000000000n), nsec: Number(stamp % 1000000000n) } },
    joints: k % 2 ? { names: ["c", "a", "b"], angle: [q3, q1, q2], torque: [tau3, tau1, tau2] }
                  : { names: ["a", "b", "c"], angle: [q1, q2, q3], torque: [tau1, tau2, tau3] },
    state: { enabled: true, mode: "auto", load: [0.5, null] },
  };
  const logTime = stamp + 2000000n;
  await writer.addMessage({ channelId, sequence: k, logTime, publishTime: logTime, data: new TextEncoder().encode(JSON.stringify(message)) });
}
await writer.end();
writeFileSync(new URL("robot_json.mcap", import.meta.url), Buffer.concat(pieces));
