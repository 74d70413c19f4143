#!/usr/bin/env bash
# nidaqmx over gRPC: a name that ends in a digit, given to four channels, gives an object for 88 channels.
#
# Expected: add_ai_voltage_chan("Dev1/ai0:3", "gauge09") returns an object for the four channels it has created.
# Seen: over gRPC the client cannot ask which channels were created (with a local driver it does). It appends "0:3"
#     to the name, and its own rule reads "gauge090:3" as a range that counts down from gauge090 to gauge003. The
#     object claims 88 channels, and every property is asked for under that name. The task, which does ask, lists
#     four.
# Versions: nidaqmx 1.7.0, grpcio 1.85.3, with a server that records what it is asked.
# Who is hurt: people who number their sensors (gauge09, film12) and move a script from a local card to a remote
#     one: each property of the object returned is asked of channels that do not exist.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "nidaqmx[grpc]==1.7.0" \
  "grpcio==1.85.3"
cat >finding.py <<'EOF'
from concurrent import futures
from importlib.metadata import version

import grpc
import nidaqmx
from nidaqmx._stubs import nidaqmx_pb2 as messages
from nidaqmx._stubs import nidaqmx_pb2_grpc as service


class Recording(service.NiDAQmxServicer):
    """Answers as a task with the four channels gauge09 to gauge12; records the names it is asked for."""

    def __init__(self) -> None:
        self.created, self.asked = [], []

    def CreateTask(self, request, context):
        task = {"name": request.session_name}
        return messages.CreateTaskResponse(task=task, new_session_initialized=True)

    def ClearTask(self, request, context):
        return messages.ClearTaskResponse()

    def CreateAIVoltageChan(self, request, context):
        self.created.append((request.physical_channel, request.name_to_assign_to_channel))
        return messages.CreateAIVoltageChanResponse()

    def GetTaskAttributeString(self, request, context):
        return messages.GetTaskAttributeStringResponse(value="gauge09, gauge10, gauge11, gauge12")

    def GetChanAttributeDouble(self, request, context):
        self.asked.append(request.channel)
        return messages.GetChanAttributeDoubleResponse(value=10.0)


servicer = Recording()
server = grpc.server(futures.ThreadPoolExecutor(2))
service.add_NiDAQmxServicer_to_server(servicer, server)
port = server.add_insecure_port("127.0.0.1:0")
server.start()
print("nidaqmx", version("nidaqmx"), "grpcio", version("grpcio"))
with grpc.insecure_channel(f"127.0.0.1:{port}") as channel:
    options = nidaqmx.GrpcSessionOptions(channel, "task")
    with nidaqmx.Task("task", grpc_options=options) as task:
        made = task.ai_channels.add_ai_voltage_chan("Dev1/ai0:3", "gauge09")
        task_has, object_has = task.ai_channels.channel_names, made.channel_names
        made.ai_max
server.stop(None)
print("created:", servicer.created)
print("the task has:", task_has)
print(f"the object has {len(object_has)} channels, {object_has[0]} to {object_has[-1]}")
print("a property is asked for:", servicer.asked)
assert servicer.created == [("Dev1/ai0:3", "gauge09")] and len(task_has) == 4, "changed"
assert len(object_has) == 88 and object_has[0] == "gauge090", "changed"
assert object_has[-1] == "gauge003" and servicer.asked == ["gauge090:3"], "changed"
EOF
venv/bin/python finding.py
