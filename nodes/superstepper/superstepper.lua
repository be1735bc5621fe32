-- A Wireshark dissector for the Super Stepper Bus, as sacbus's virtual SS-MST67 modules speak it.
--
-- Reads captures of sacbus with link type USER2 (149): a message, an answer or a run of garbage a
-- frame. Nothing in the bytes tells a message from an answer; the two have wires of their own, and
-- each of these is an interface ("lane 0" the master's, "lane 1" the modules'). Where a capture has
-- one lane alone, five bytes with a right checksum and a reserved byte of 0 are an answer.
--
-- The places of bits that the vendor's figures hold are decisions: docs/superstepper.md of sacbus.
-- Runs on Lua 5.1 to 5.4: no bit library is in all of them.

local ss = Proto("superstepper", "Super Stepper Bus")

-- An answer that comes later answers nothing, s.
local ANSWERED_WITHIN = 2

local OPCODES = { [0] = "move at speed", "move steps", "change speed", "microsteps and decay", "stop",
    "expanded", "write", "read" }
local SIZES = { [0] = 4, 6, 3, 2, 2, 1, 4, 3 }
local RATES = { [0] = "fast, / 1", "medium, / 8", "slow, / 64", "none" }
local DECAYS = { [0] = "fast", "mixed", "mixed", "slow" }
local MICROSTEPS = { [0] = "full", "half", "quad", "eight" }

local f = {
    type = ProtoField.string("superstepper.type", "Type", base.ASCII,
        "message, ack, nak, garbage, collision"),
    addr = ProtoField.uint8("superstepper.addr", "Module", base.DEC),
    opcode = ProtoField.uint8("superstepper.opcode", "Opcode", base.DEC, OPCODES),
    command = ProtoField.string("superstepper.command", "Command"),
    clockwise = ProtoField.bool("superstepper.clockwise", "Clockwise"),
    rate = ProtoField.uint8("superstepper.rate", "Rate", base.DEC, RATES),
    accelerate = ProtoField.bool("superstepper.accelerate", "Acceleration profile"),
    home = ProtoField.bool("superstepper.home", "Stop at home"),
    speed = ProtoField.uint16("superstepper.speed", "Speed", base.DEC),
    steps = ProtoField.uint16("superstepper.steps", "Steps", base.DEC),
    microsteps = ProtoField.uint8("superstepper.microsteps", "Steps are", base.DEC, MICROSTEPS),
    decay = ProtoField.uint8("superstepper.decay", "Decay", base.DEC, DECAYS),
    decelerate = ProtoField.bool("superstepper.decelerate", "Decelerate"),
    enable = ProtoField.bool("superstepper.enable", "Driver enabled"),
    eeprom = ProtoField.bool("superstepper.eeprom", "EEPROM"),
    word = ProtoField.bool("superstepper.word", "Word"),
    place = ProtoField.uint8("superstepper.place", "Address in memory", base.HEX),
    byte = ProtoField.uint8("superstepper.byte", "Byte", base.HEX),
    framing = ProtoField.bool("superstepper.framing", "Framing error seen"),
    overrun = ProtoField.bool("superstepper.overrun", "Overrun seen"),
    value = ProtoField.uint16("superstepper.value", "Value", base.DEC),
    checksum = ProtoField.uint8("superstepper.checksum", "Checksum", base.HEX),
    garbage = ProtoField.string("superstepper.garbage", "Garbage"),
    collision = ProtoField.string("superstepper.collision", "Collision with"),
    bytes = ProtoField.bytes("superstepper.bytes", "Bytes"),
    sender = ProtoField.string("superstepper.sender", "Sender"),
    response_in = ProtoField.framenum("superstepper.response_in", "Response in", base.NONE,
        frametype.RESPONSE),
    response_to = ProtoField.framenum("superstepper.response_to", "Response to", base.NONE,
        frametype.REQUEST),
    response_time = ProtoField.relative_time("superstepper.response_time", "Response time",
        "From the end of the message to the first bit of its answer"),
}
ss.fields = f

local e = {
    garbage = ProtoExpert.new("superstepper.expert.garbage", "Bytes that make nothing",
        expert.group.MALFORMED, expert.severity.ERROR),
    collision = ProtoExpert.new("superstepper.expert.collision", "Others talked at the same time",
        expert.group.PROTOCOL, expert.severity.ERROR),
    nak = ProtoExpert.new("superstepper.expert.nak", "The message did not come whole",
        expert.group.RESPONSE_CODE, expert.severity.WARN),
    flagged = ProtoExpert.new("superstepper.expert.flagged", "The module has missed something",
        expert.group.CHECKSUM, expert.severity.WARN),
    no_answer = ProtoExpert.new("superstepper.expert.no_answer", "No answer",
        expert.group.SEQUENCE, expert.severity.WARN),
}
ss.experts = { e.garbage, e.collision, e.nak, e.flagged, e.no_answer }

local frame_time = Field.new("frame.time_epoch")
local frame_comment = Field.new("frame.comment")
local frame_interface = Field.new("frame.interface_name")

-- Some bits of a byte.
local function bits(byte, low, width)
    return math.floor(byte / 2 ^ low) % 2 ^ (width or 1)
end

local function flag(byte, low)
    return bits(byte, low) == 1
end

-- What sacbus's comments say of this frame, by their keys.
local function remarks_of_frame()
    local remarks = {}
    for _, comment in ipairs({ frame_comment() }) do
        for line in tostring(comment.value):gmatch("[^\n]+") do
            local key, value = line:match("^([%a ]+): (.*)$")
            if key then remarks[key] = value end
        end
    end
    return remarks
end

-- The line that this frame is of, and which of its lanes, if the capture has both.
local function line_of_frame()
    local interface = frame_interface()
    local name = interface and tostring(interface.value) or ""
    local line, lane = name:match("^(.*) lane (%d+)$")
    return line or name, tonumber(lane)
end

local function is_answer(data, lane)
    if #data ~= 5 or lane == 0 then return false end
    local a, b, c, d, sum = data:byte(1, 5)
    return (a + b + c + d) % 256 == sum and (lane == 1 or b == 0)
end

-- What is known of each frame, and who was asked last on each line. Filled on the first pass.
local known, asked

function ss.init()
    known, asked = {}, {}
end

local function fact_of(kind, address, line, pinfo, start, stop)
    local fact = known[pinfo.number]
    if pinfo.visited and fact then
        fact.complete = true
        return fact
    end
    fact = { frame = pinfo.number, start = start, stop = stop }
    known[pinfo.number] = fact
    local pair = address .. " " .. line
    if kind == "message" then
        asked[pair] = fact
    else
        local request = asked[pair]
        asked[pair] = nil
        local time = request and start - request.stop
        if request and time:tonumber() <= ANSWERED_WITHIN then
            fact.request, request.answer = request.frame, fact.frame
            fact.time = time:tonumber() < 0 and NSTime.new(0, 0) or time
        end
    end
    return fact
end

local function add_direction(tree, range)
    local how = range(1, 1):uint()
    tree:add(f.clockwise, range(1, 1), flag(how, 2))
    tree:add(f.rate, range(1, 1), bits(how, 0, 2))
    tree:add(f.speed, range(2, 2))
end

local add_operands = {
    [0] = function(tree, range)
        add_direction(tree, range)
        tree:add(f.accelerate, range(1, 1), flag(range(1, 1):uint(), 3))
    end,
    [1] = function(tree, range)
        add_direction(tree, range)
        tree:add(f.home, range(1, 1), flag(range(1, 1):uint(), 3))
        tree:add(f.steps, range(4, 2))
    end,
    [2] = function(tree, range) tree:add(f.speed, range(1, 2)) end,
    [3] = function(tree, range)
        local how = range(1, 1):uint()
        tree:add(f.microsteps, range(1, 1), bits(how, 0, 2))
        tree:add(f.decay, range(1, 1), bits(how, 2, 2))
    end,
    [4] = function(tree, range)
        local how = range(1, 1):uint()
        tree:add(f.decelerate, range(1, 1), flag(how, 1))
        tree:add(f.enable, range(1, 1), flag(how, 0))
    end,
    [5] = function() end,
    [6] = function(tree, range)
        tree:add(f.eeprom, range(1, 1), flag(range(1, 1):uint(), 0))
        tree:add(f.place, range(2, 1))
        tree:add(f.byte, range(3, 1))
    end,
    [7] = function(tree, range)
        tree:add(f.eeprom, range(1, 1), flag(range(1, 1):uint(), 0))
        tree:add(f.word, range(1, 1), flag(range(1, 1):uint(), 1))
        tree:add(f.place, range(2, 1))
    end,
}

local function add_message(tree, range, fact, remarks)
    local header = range(0, 1):uint()
    local opcode = bits(header, 0, 3)
    tree:add(f.opcode, range(0, 1), opcode)
    add_operands[opcode](tree, range)
    local words = remarks["words"] or OPCODES[opcode]
    if remarks["words"] then tree:add(f.command, range(0), words):set_generated() end
    if fact.answer then
        tree:add(f.response_in, fact.answer):set_generated()
    elseif fact.complete then
        tree:add_proto_expert_info(e.no_answer)
    end
    return words
end

local function add_answer(tree, range, kind, fact)
    local first = range(0, 1):uint()
    local framing, overrun = flag(first, 6), flag(first, 5)
    tree:add(f.framing, range(0, 1), framing)
    tree:add(f.overrun, range(0, 1), overrun)
    tree:add(f.value, range(2, 2))
    tree:add(f.checksum, range(4, 1))
    if framing or overrun then tree:add_proto_expert_info(e.flagged) end
    if kind == "nak" then tree:add_proto_expert_info(e.nak) end
    if fact.request then tree:add(f.response_to, fact.request):set_generated() end
    if fact.time then tree:add(f.response_time, fact.time):set_generated() end
    local value = range(2, 2):uint()
    return kind:upper() .. (value ~= 0 and " " .. value or "")
end

local function kind_of(data, lane, remarks)
    if remarks["collision with"] then return "collision" end
    if remarks["garbage"] then return "garbage" end
    if is_answer(data, lane) then return flag(data:byte(1), 7) and "ack" or "nak" end
    if lane ~= 1 and #data == SIZES[bits(data:byte(1), 0, 3)] then return "message" end
    return "garbage"
end

function ss.dissector(buffer, pinfo, tree)
    local size = buffer:len()
    if size == 0 then return 0 end
    local range = buffer(0, size)
    local data = buffer:raw(0, size)
    local remarks = remarks_of_frame()
    local line, lane = line_of_frame()
    local kind = kind_of(data, lane, remarks)
    pinfo.cols.protocol = "Super Stepper"
    local branch = tree:add(ss, range)
    branch:add(f.type, range, kind):set_generated()
    if remarks["sender"] then branch:add(f.sender, range, remarks["sender"]):set_generated() end
    local said
    if kind == "garbage" or kind == "collision" then
        local words = remarks["garbage"] or remarks["collision with"] or "noise"
        branch:add(f[kind], range, words):set_generated()
        branch:add(f.bytes, range)
        branch:add_proto_expert_info(e[kind])
        said = kind .. ": " .. words
    else
        local first = data:byte(1)
        local address = kind == "message" and bits(first, 3, 5) or bits(first, 0, 5)
        local stamp = frame_time()
        local start = stamp and stamp.value or NSTime.new(0, 0)
        local long = tonumber((remarks["on the line"] or ""):match("^(%d+) ns$") or 0)
        local stop = start + NSTime.new(math.floor(long / 1e9), long % 1e9)
        local fact = fact_of(kind, address, line, pinfo, start, stop)
        branch:add(f.addr, range(0, 1), address)
        if kind == "message" then
            said = add_message(branch, range, fact, remarks)
            pinfo.cols.src, pinfo.cols.dst = "master", tostring(address)
        else
            said = add_answer(branch, range, kind, fact)
            pinfo.cols.src, pinfo.cols.dst = tostring(address), "master"
        end
    end
    branch:append_text(", " .. said)
    pinfo.cols.info = said
    return size
end

local encapsulations = wtap_encaps or wtap
DissectorTable.get("wtap_encap"):add(encapsulations.USER2, ss)
