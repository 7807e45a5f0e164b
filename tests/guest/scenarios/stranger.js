// SPDX-License-Identifier: Apache-2.0
// A foreign CANopen stack (npm's `canopen`) as SDO client and as a device with an SDO server.
//
//   node stranger.js FOLDER-OF-node_modules NODE-ID EDS-FILE [plc]
//
// Standard input and output carry one JSON value per line. Both directions: {"id": 1413, "data": "60..."}, a frame.
// Input: {"ask": "upload" | "download", "server": 5, "index": 4104, "sub": 0, "data": "..."}; output: the answer,
// {"answer": "..."} or {"refused": "..."}; {"ready": true} is sent once. The EDS that the foreign stack writes of
// itself goes to EDS-FILE. It sends no boot-up message, and a reset would remove its SDO server.
//
// With `plc` it is the master of node 5, and obeys: {"ask": "nmt", "command": "startNode", "server": 5}, a command by
// its name in the package (without a server: itself), and {"ask": "pdo", "data": "3c"}: RPDO 1 of the node. It reports
// what it receives of the node: {"heard": "state", "value": 127}, "silence", "pdo" or "emcy".
const Module = require('module');
const path = require('path');
const readline = require('readline');

// The package computes the CRC of block transfers with a module that needs a compiler. This replaces it: CRC-16,
// polynomial 1021h.
function crc(...parameters) {
  let sum = 0;
  for (const byte of parameters.at(-1)) {
    sum ^= byte << 8;
    for (let bit = 0; bit < 8; ++bit) {
      sum = ((sum << 1) ^ (sum & 0x8000 ? 0x1021 : 0)) & 0xffff;
    }
  }
  return Buffer.from([sum >> 8, sum & 0xff]);
}
const load = Module._load;
Module._load = (name, ...rest) => (name === 'node-crc' ? { crc } : load(name, ...rest));

const [folder, id, file] = [process.argv[2], Number(process.argv[3]), process.argv[4]];
const { Device, Eds, DataType, AccessType } = require(path.join(folder, 'canopen'));

const SERVERS = [5, 127];
const PLC = process.argv[5] === 'plc';
const SLAVE = 5;
const PATIENCE = 2000; // ms without a heartbeat of the slave

function makeEds() {
  const eds = new Eds({ vendorName: 'A stranger', vendorNumber: 0x51, productName: 'node-canopen',
    productNumber: 0x52, revisionNumber: 0x10001 });
  const save = { saveDefault: true };
  eds.getEntry(0x1000).value = 0x00030191;
  eds.getEntry(0x1000).defaultValue = 0x00030191;
  eds.setIdentity({ vendorId: 0x51, productCode: 0x52, revisionNumber: 0x10001, serialNumber: 7 }, save);
  eds.setDeviceName('a device of the stranger', save);
  eds.setHeartbeatProducerTime(0, save);
  eds.addEntry(0x2000, { parameterName: 'Number', dataType: DataType.UNSIGNED32,
    accessType: AccessType.READ_WRITE, defaultValue: 1 });
  eds.addEntry(0x2001, { parameterName: 'Text', dataType: DataType.VISIBLE_STRING,
    accessType: AccessType.READ_WRITE, defaultValue: 'text' });
  eds.save(file);
  eds.addSdoServerParameter(0, 0x580 + id, 0x600 + id);
  for (const server of SERVERS) {
    eds.addSdoClientParameter(server, 0x600 + server, 0x580 + server);
  }
  if (PLC) {
    addMaster(eds);
  }
  return eds;
}

function addMaster(eds) {
  const byte = { dataType: DataType.UNSIGNED8, accessType: AccessType.READ_WRITE, defaultValue: 0 };
  const received = eds.addEntry(0x2010, { parameterName: 'Received', ...byte });
  const commanded = eds.addEntry(0x2011, { parameterName: 'Commanded', ...byte });
  eds.addReceivePdo({ cobId: 0x180 + SLAVE, transmissionType: 255, dataObjects: [received] });
  eds.addTransmitPdo({ cobId: 0x200 + SLAVE, transmissionType: 255, dataObjects: [commanded] });
  eds.addHeartbeatConsumer(SLAVE, PATIENCE);
  eds.addEmcyConsumer(0x80 + SLAVE);
}

function tell(value) {
  process.stdout.write(JSON.stringify(value) + '\n');
}

async function answer(ask) {
  const transfer = { serverId: ask.server, index: ask.index, subIndex: ask.sub, timeout: 20000 };
  try {
    if (ask.ask === 'upload') {
      const data = await device.sdo.upload(transfer);
      tell({ answer: data.toString('hex') });
    } else if (ask.ask === 'nmt') {
      device.nmt[ask.command](ask.server ?? undefined);
      tell({ answer: '' });
    } else if (ask.ask === 'pdo') {
      eds.getEntry(0x2011).value = Buffer.from(ask.data, 'hex')[0];
      device.pdo.write(0x200 + SLAVE);
      tell({ answer: '' });
    } else {
      await device.sdo.download({ ...transfer, data: Buffer.from(ask.data, 'hex') });
      tell({ answer: '' });
    }
  } catch (error) {
    tell({ refused: String(error.message ?? error) });
  }
}

const eds = makeEds();
const device = new Device({ id, eds });
if (PLC) {
  const heard = (what, value) => tell({ heard: what, value });
  device.nmt.addListener('heartbeat', ({ deviceId, state }) => deviceId === SLAVE && heard('state', state));
  device.nmt.addListener('timeout', () => heard('silence', 0));
  device.pdo.addListener('pdo', ({ dataObjects }) => heard('pdo', dataObjects[0].value));
  device.emcy.addListener('emergency', ({ em }) => heard('emcy', em.code));
}
device.addListener('message', ({ id: identifier, data }) =>
  tell({ id: identifier, data: Buffer.from(data).toString('hex') }));
readline.createInterface({ input: process.stdin }).on('line', (line) => {
  const value = JSON.parse(line);
  if (value.ask === undefined) {
    const data = Buffer.from(value.data, 'hex');
    device.receive({ id: value.id, data, len: data.length });
  } else {
    answer(value);
  }
}).on('close', () => process.exit(0));
device.start();
tell({ ready: true });
