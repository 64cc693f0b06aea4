// SPDX-License-Identifier: Apache-2.0
// usage: node mcap.cjs write FILE none|lz4|zstd PICTURE...    a recording with these PNG files as images, 50 ms apart
//        node mcap.cjs read FILE                              a line of JSON for each message
//
// Knows nothing of Farpoint: the container is by @mcap/core, messages and their definitions by @foxglove.
'use strict';
const { createHash } = require('crypto');
const { execFileSync } = require('child_process');
const fs = require('fs');
const path = require('path');
// The packages lie where npm ci put them, not beside this file.
const modules = path.join(process.env.MCAP_HOME, 'node_modules');
const { McapStreamReader, McapWriter } = require(path.join(modules, '@mcap/core'));
const { ros2humble } = require(path.join(modules, '@foxglove/rosmsg-msgs-common'));
const { MessageReader, MessageWriter } = require(path.join(modules, '@foxglove/rosmsg2-serialization'));
const SECONDS = 1600000000;

// A type with all types that it holds, itself first.
function definitionsOf(type, seen = new Map()) {
  const name = type.replace('/msg/', '/');
  if (!seen.has(name)) {
    seen.set(name, ros2humble[name]);
    for (const field of ros2humble[name].definitions)
      if (field.isComplex) definitionsOf(field.type, seen);
  }
  return [...seen.values()];
}

const header = (nanoseconds, frame) =>
  ({ stamp: { sec: SECONDS + Math.floor(nanoseconds / 1e9), nanosec: nanoseconds % 1e9 }, frame_id: frame });

function messages(pictures) {
  const info = {
    header: header(0, 'cam0'), height: 48, width: 64, distortion_model: 'plumb_bob', d: [-0.1, 0.01, 0.002, -0.003, 0],
    k: [50, 0, 31, 0, 51, 23, 0, 0, 1], r: [1, 0, 0, 0, 1, 0, 0, 0, 1], p: [50, 0, 31, 0, 0, 51, 23, 0, 0, 0, 1, 0],
  };
  const all = [['/cam0/camera_info', 'sensor_msgs/msg/CameraInfo', 0, info]];
  pictures.forEach((picture, number) => {
    const at = 50e6 * number;
    const image = { header: header(at, 'cam0'), format: 'png', data: fs.readFileSync(picture) };
    all.push(['/cam0/image_raw/compressed', 'sensor_msgs/msg/CompressedImage', at, image]);
    const imu = {
      header: header(at, 'imu'), angular_velocity: { x: 0.1, y: 0.2, z: number },
      linear_acceleration: { x: 0, y: 0, z: 9.81 },
    };
    all.push(['/imu', 'sensor_msgs/msg/Imu', at, imu]);
    const twist = { twist: { linear: { x: 1.5 + number, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0.25 } } };
    all.push(['/odom', 'nav_msgs/msg/Odometry', at, { header: header(at, 'odom'), child_frame_id: 'base', twist }]);
  });
  return all;
}

async function write(file, compression, ...pictures) {
  const parts = [];
  let position = 0n;
  const writable = {
    position: () => position,
    write: async (data) => { parts.push(Buffer.from(data)); position += BigInt(data.length); },
  };
  const compressChunk = compression === 'none' ? undefined : (data) => ({
    compression, compressedData: execFileSync(compression, ['-q', '-c'], { input: Buffer.from(data) }) });
  const writer = new McapWriter({ writable, compressChunk });
  await writer.start({ profile: 'ros2', library: 'mcap.cjs' });
  const channels = new Map();
  for (const [topic, type, nanoseconds, message] of messages(pictures)) {
    if (!channels.has(topic)) {
      const schemaId = await writer.registerSchema({ name: type, encoding: 'ros2msg', data: Buffer.from('see ROS') });
      const id = await writer.registerChannel({ topic, schemaId, messageEncoding: 'cdr', metadata: new Map() });
      channels.set(topic, { id, sequence: 0, writer: new MessageWriter(definitionsOf(type)) });
    }
    const channel = channels.get(topic);
    const logTime = BigInt(SECONDS) * 1000000000n + BigInt(nanoseconds);
    await writer.addMessage({ channelId: channel.id, sequence: channel.sequence++, logTime, publishTime: logTime,
      data: channel.writer.writeMessage(message) });
  }
  await writer.end();
  fs.writeFileSync(file, Buffer.concat(parts));
}

async function read(file) {
  const unpack = (program) => (data) => execFileSync(program, ['-q', '-d', '-c'], { input: Buffer.from(data) });
  const reader = new McapStreamReader({ decompressHandlers: { lz4: unpack('lz4'), zstd: unpack('zstd') } });
  reader.append(fs.readFileSync(file));
  const schemas = new Map(), channels = new Map();
  for (let record; (record = reader.nextRecord());) {
    if (record.type === 'Schema') schemas.set(record.id, record.name);
    if (record.type === 'Channel') channels.set(record.id, record);
    if (record.type !== 'Message') continue;
    const channel = channels.get(record.channelId), type = schemas.get(channel.schemaId);
    if (channel.messageEncoding !== 'cdr') continue;
    const message = new MessageReader(definitionsOf(type)).readMessage(record.data);
    if (message.data) message.data = createHash('sha256').update(message.data).digest('hex');
    const line = { topic: channel.topic, type, time: record.logTime.toString(), message };
    process.stdout.write(JSON.stringify(line, (_, value) => (ArrayBuffer.isView(value) ? [...value] : value)) + '\n');
  }
  if (!reader.done()) throw new Error(`${file} does not end as a recording does`);
}

const [what, ...rest] = process.argv.slice(2);
({ write, read })[what](...rest).catch((error) => { console.error(error); process.exit(1); });
