-- A Wireshark dissector for the SAC network of virtual and real stepper controllers.
--
-- Reads the bytes of the RS485 line as link type USER0 (147), one or more packets a frame, and of
-- TCP connections to a bus by "Decode As". Frames, CRC and answers are decoded here, from bytes
-- alone. What bytes do not tell (a command in words, who sent it, how long it took) is taken from
-- the comments that sacbus writes to its captures, "KEY: VALUE" in each line.
--
-- Installing and using it: docs/wireshark.md of sacbus. Runs on Lua 5.1 to 5.4: no bit library is
-- in all of them, so the CRC does without.

local sac = Proto("sac", "SAC network")

local STX, ETX, ACK, NAK = 0x02, 0x03, 0x06, 0x15
local EVERYBODY, MOTHER = 0, 1
-- A frame that has not ended after so many bytes is given up, as sacbus's receiver does.
local MAX_FRAME = 255
-- An answer that comes later answers nothing, s. The monitor forgets a packet about as late.
local ANSWERED_WITHIN = 2

sac.prefs.baud = Pref.uint(
    "Line rate (baud)", 38400,
    "Tells when a packet ended where a capture does not say how long it was on the line")

local f = {
    type = ProtoField.string("sac.type", "Type", base.ASCII, "packet, ack, nak, garbage, collision"),
    dst = ProtoField.uint8("sac.dst", "Destination", base.DEC),
    src = ProtoField.uint8("sac.src", "Source", base.DEC),
    addr = ProtoField.uint8("sac.addr", "Source or destination", base.DEC),
    broadcast = ProtoField.bool("sac.broadcast", "General call"),
    body = ProtoField.string("sac.body", "Body"),
    command = ProtoField.string("sac.command", "Command"),
    message = ProtoField.string("sac.message", "Message"),
    soft_op = ProtoField.string("sac.soft_op", "Soft op"),
    forward_to = ProtoField.uint8("sac.forward.to", "To be sent on to", base.DEC),
    forward_line = ProtoField.string("sac.forward.line", "Line to be sent on"),
    forward_in = ProtoField.framenum("sac.forward.in", "Sent on in", base.NONE),
    forward_of = ProtoField.framenum("sac.forward.of", "Sends on a line of", base.NONE),
    crc = ProtoField.uint8("sac.crc", "CRC", base.HEX),
    crc_status = ProtoField.string("sac.crc.status", "CRC status", base.ASCII,
        "right, wrong, unchecked (none was sent), no NUL (right, but what follows is missing)"),
    crc_expected = ProtoField.uint8("sac.crc.expected", "CRC of this body", base.HEX),
    garbage = ProtoField.string("sac.garbage", "Garbage"),
    bytes = ProtoField.bytes("sac.bytes", "Bytes"),
    collision = ProtoField.string("sac.collision", "Collision with"),
    sender = ProtoField.string("sac.sender", "Sender"),
    response_in = ProtoField.framenum("sac.response_in", "Response in", base.NONE,
        frametype.RESPONSE),
    response_to = ProtoField.framenum("sac.response_to", "Response to", base.NONE,
        frametype.REQUEST),
    response_time = ProtoField.relative_time("sac.response_time", "Response time",
        "From the end of the packet to the first bit of its answer"),
}
sac.fields = f

local e = {
    wrong_crc = ProtoExpert.new("sac.expert.crc", "CRC is wrong",
        expert.group.CHECKSUM, expert.severity.ERROR),
    no_nul = ProtoExpert.new("sac.expert.no_nul", "NUL behind the CRC is missing",
        expert.group.MALFORMED, expert.severity.WARN),
    garbage = ProtoExpert.new("sac.expert.garbage", "Bytes that make no packet",
        expert.group.MALFORMED, expert.severity.ERROR),
    collision = ProtoExpert.new("sac.expert.collision", "Others talked at the same time",
        expert.group.PROTOCOL, expert.severity.ERROR),
    nak = ProtoExpert.new("sac.expert.nak", "Refused: its CRC was wrong",
        expert.group.RESPONSE_CODE, expert.severity.WARN),
    no_answer = ProtoExpert.new("sac.expert.no_answer", "No answer",
        expert.group.SEQUENCE, expert.severity.WARN),
    stray = ProtoExpert.new("sac.expert.stray", "Answers nothing that was captured",
        expert.group.SEQUENCE, expert.severity.NOTE),
}
sac.experts = { e.wrong_crc, e.no_nul, e.garbage, e.collision, e.nak, e.no_answer, e.stray }

local frame_time = Field.new("frame.time_epoch")
local frame_comment = Field.new("frame.comment")
local frame_drops = Field.new("frame.drop_count")
local frame_interface = Field.new("frame.interface_name")

-- The exclusive or of two bytes.
local function xor(a, b)
    local result, weight = 0, 1
    for _ = 1, 8 do
        if a % 2 ~= b % 2 then result = result + weight end
        a, b, weight = math.floor(a / 2), math.floor(b / 2), weight * 2
    end
    return result
end

-- CRC-8 Dallas/Maxim of a string: polynomial 0x31, reflected 0x8C, from 0.
local crc_of_byte = {}
for byte = 0, 255 do
    local crc = byte
    for _ = 1, 8 do
        local low = crc % 2
        crc = math.floor(crc / 2)
        if low == 1 then crc = xor(crc, 0x8C) end
    end
    crc_of_byte[byte] = crc
end

local function crc8(text)
    local crc = 0
    for place = 1, #text do
        crc = crc_of_byte[xor(crc, text:byte(place))]
    end
    return crc
end

-- What stands at a place (from 1) of the bytes: a table with `kind`, and `stop`, its last byte.
-- The rules, and their order, are those of sacbus/wire/robust.py. At the end of the bytes nothing
-- more is waited for, but `open` is set where more might have changed it.
local function unit_at(data, at)
    if data:byte(at) ~= STX then
        local stx = data:find("\2", at, true)
        local stop = math.min((stx or #data + 1) - 1, at + MAX_FRAME - 1)
        return { kind = "garbage", words = "noise", stop = stop }
    end
    local limit = math.min(#data, at + MAX_FRAME - 1)
    local function first(byte, from, to)
        for place = from, to do
            if data:byte(place) == byte then return place end
        end
        return nil
    end
    local etx = first(ETX, at + 3, limit)
    local stx = first(STX, at + 1, (etx or limit + 1) - 1)
    local mark = at + 3 <= limit and data:byte(at + 3) or nil
    local dst, src = data:byte(at + 1), data:byte(at + 2)

    if (mark == ACK or mark == NAK) and not (stx == at + 1 or stx == at + 2) then
        local unit = { kind = mark == ACK and "ack" or "nak", dst = dst, src = src, stop = at + 3 }
        local ending = "\3" .. string.char(crc8(string.char(mark))) .. "\0"
        if data:sub(at + 4, at + 5) == "\3\0" then
            unit.stop = at + 5
        elseif data:sub(at + 4, at + 6) == ending then
            unit.stop = at + 6
        end
        return unit
    end
    if stx then return { kind = "garbage", words = "cut short", stop = stx - 1 } end
    local function given_up()
        if limit - at + 1 == MAX_FRAME then
            return { kind = "garbage", words = "too long", stop = limit }
        end
        return { kind = "garbage", words = "unfinished", stop = limit, open = true }
    end
    if not etx or etx == limit then return given_up() end

    local check = data:byte(etx + 1)
    local behind = etx + 2 <= limit and data:byte(etx + 2) or nil
    local body = data:sub(at + 3, etx - 1)
    local crc = crc8(body)
    local unit = { kind = "packet", dst = dst, src = src, body = body, etx = etx,
        expected = crc, stop = etx + 1 }
    if check == 0 then
        unit.verdict = crc == 0 and "right" or "unchecked"
        -- The CRC may be 00: then one NUL more belongs to it.
        if crc == 0 and data:byte(etx + 2) == 0 then unit.stop = etx + 2 end
        return unit
    end
    if check == STX and not (crc == STX and behind == 0) then
        return { kind = "garbage", words = "cut short", stop = etx }
    end
    if not behind and limit - at + 1 == MAX_FRAME then return given_up() end
    -- At the end of a capture's frame the NUL is missing; in a stream it may yet come.
    unit.open = not behind
    unit.check = check
    if behind == 0 then unit.stop = etx + 2 end
    unit.verdict = check ~= crc and "wrong" or behind == 0 and "right" or "no NUL"
    return unit
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

-- How long bytes take on the line, as the preference says.
local function span(count)
    return count * 10 / sac.prefs.baud
end

local function later(time, seconds)
    local nanos = math.floor(seconds * 1e9 + 0.5)
    return time + NSTime.new(math.floor(nanos / 1e9), nanos % 1e9)
end

-- The name of the line that this frame is of: the lanes of one are interfaces of their own.
local function line_of_frame()
    local interface = frame_interface()
    return interface and tostring(interface.value):gsub(" lane %d+$", "") or ""
end

-- What is known of the units of all frames so far, by frame and number in it: what each answers,
-- what answers it. Filled on the first pass, in the order of the file.
local known, asked, to_send_on

function sac.init()
    known, asked, to_send_on = {}, {}, {}
end

-- Who asked whom, on which line.
local function pair_of(from, to)
    return from .. ">" .. to .. " " .. line_of_frame()
end

local function link_answer(unit, fact)
    local pair = pair_of(unit.dst, unit.src)
    local request = asked[pair]
    asked[pair] = nil
    if not request then return end
    local time = fact.start - request.stop
    if time:tonumber() > ANSWERED_WITHIN then return end
    fact.request = request.frame
    request.answer = fact.frame
    if not fact.inexact then
        -- An answer cannot begin before its packet ended; the clock of an arrival may say so.
        fact.time = time:tonumber() < 0 and NSTime.new(0, 0) or time
    end
end

local function link_packet(unit, fact)
    if unit.dst ~= EVERYBODY then asked[pair_of(unit.src, unit.dst)] = fact end
    -- Is it the line that somebody else's packet asked its sender to send on?
    local key = unit.src .. " " .. line_of_frame()
    local waiting = to_send_on[key]
    if waiting and waiting.line == unit.body and (waiting.to or unit.dst) == unit.dst then
        fact.forward_of = waiting.fact.frame
        waiting.fact.forward_in = fact.frame
        to_send_on[key] = nil
    end
    if unit.forward then
        to_send_on[unit.dst .. " " .. line_of_frame()] = { to = unit.forward.to, line = unit.forward.line, fact = fact }
    end
end

-- The fact of a unit: made on the first pass, where answers and packets meet.
local function fact_of(unit, pinfo, number, remarks, times)
    local key = pinfo.number .. "/" .. number
    if pinfo.visited and known[key] then
        known[key].complete = true -- and so are those of all frames
        return known[key]
    end
    local fact = { frame = pinfo.number, start = times.start, stop = times.stop,
        inexact = remarks["delay"] ~= nil }
    known[key] = fact
    if number == 1 and frame_drops() then asked, to_send_on = {}, {} end
    if unit.kind == "ack" or unit.kind == "nak" then
        link_answer(unit, fact)
    elseif unit.kind == "packet" then
        link_packet(unit, fact)
    end
    return fact
end

-- What a body alone tells: a soft op, a message, a line for another node. Of an address that is too
-- great a device uses the low byte.
local function read_body(unit)
    local body = unit.body
    if body == "\17" or body:match("^\17 ") then
        unit.soft_op = "DC1, motion has begun"
    elseif body == "\18" or body:match("^\18 ") then
        unit.soft_op = "DC2, motion has ended"
    elseif body:match("^[ .]") and body:match("[^ ]") then
        unit.message = body
    elseif body:match("^%d") then
        local digits, line = body:match("^(%d+)(.*)$")
        local to = 0
        for digit in digits:gmatch("%d") do to = (to * 10 + tonumber(digit)) % 256 end
        unit.forward = { to = to, line = line }
    elseif body:match("^/") then
        unit.forward = { to = nil, line = body:sub(2) }
    end
end

local function printable(text)
    return (text:gsub("[^\32-\126]", function(one) return ("\\x%02x"):format(one:byte()) end))
end

local function hex(text, most)
    local shown = text:sub(1, most):gsub(".", function(one) return ("%02x "):format(one:byte()) end)
    return shown:sub(1, -2) .. (#text > most and " …" or "")
end

local function name_of(address)
    return address == EVERYBODY and "all" or tostring(address)
end

local function add_addresses(tree, range, unit)
    local to, from = tree:add(f.dst, range(1, 1)), tree:add(f.src, range(2, 1))
    if unit.dst == EVERYBODY then to:append_text(" (all)") end
    if unit.dst == MOTHER then to:append_text(" (mother)") end
    if unit.src == MOTHER then from:append_text(" (mother)") end
    tree:add(f.addr, range(1, 1)):set_hidden()
    tree:add(f.addr, range(2, 1)):set_hidden()
    if unit.dst == EVERYBODY then tree:add(f.broadcast, range(1, 1), true):set_generated() end
end

local function add_packet(tree, range, unit, fact, remarks, pinfo)
    add_addresses(tree, range, unit)
    local size = #unit.body
    local words = remarks["words"]
    local where = size > 0 and range(3, size) or range(3, 1)
    if size > 0 then
        tree:add_packet_field(f.body, where, ENC_ISO_8859_1)
    else
        tree:add(f.body, where, "")
    end
    if words then tree:add(f.command, where, words):set_generated() end
    if unit.soft_op then tree:add(f.soft_op, where, unit.soft_op) end
    if unit.message then tree:add_packet_field(f.message, where, ENC_ISO_8859_1) end
    if unit.forward then
        if unit.forward.to then tree:add(f.forward_to, where, unit.forward.to) end
        tree:add(f.forward_line, where, printable(unit.forward.line))
    end
    local after = size + 4
    if unit.check then tree:add(f.crc, range(after, 1)) end
    local status = tree:add(f.crc_status, range(after, 1), unit.verdict)
    status:set_generated()
    if unit.verdict == "wrong" then
        status:add_proto_expert_info(e.wrong_crc)
        tree:add(f.crc_expected, range(after, 1), unit.expected):set_generated()
    elseif unit.verdict == "no NUL" then
        status:add_proto_expert_info(e.no_nul)
    end
    if fact.forward_of then tree:add(f.forward_of, fact.forward_of):set_generated() end
    if fact.forward_in then tree:add(f.forward_in, fact.forward_in):set_generated() end
    if fact.answer then
        tree:add(f.response_in, fact.answer):set_generated()
    elseif fact.complete and unit.dst ~= EVERYBODY then
        tree:add_proto_expert_info(e.no_answer)
    end
    local said = words or unit.soft_op
    local shown = unit.soft_op and "" or printable(unit.body)
    return shown .. (said and (shown ~= "" and ": " or "") .. said or "")
        .. (unit.verdict == "wrong" and " [CRC wrong]" or "")
        .. (unit.verdict == "unchecked" and " [no CRC]" or "")
        .. (unit.verdict == "no NUL" and " [no NUL]" or "")
end

local function add_answer(tree, range, unit, fact)
    add_addresses(tree, range, unit)
    local said = unit.kind:upper()
    if unit.kind == "nak" then tree:add_proto_expert_info(e.nak) end
    if not fact.request then
        tree:add_proto_expert_info(e.stray)
        return said
    end
    tree:add(f.response_to, fact.request):set_generated()
    if not fact.time then return said end
    tree:add(f.response_time, fact.time):set_generated()
    return ("%s after %d us"):format(said, math.floor(fact.time:tonumber() * 1e6 + 1e-4))
end

local function add_collision(tree, range, data, others)
    tree:add(f.collision, range, others):set_generated()
    tree:add(f.bytes, range)
    tree:add_proto_expert_info(e.collision)
    return ("collision with %s: %s"):format(others, hex(data, 24))
end

local function add_garbage(tree, range, data, words)
    tree:add(f.garbage, range, words):set_generated()
    tree:add(f.bytes, range)
    tree:add_proto_expert_info(e.garbage)
    return ("%s: %s"):format(words, hex(data, 24))
end

-- A unit's own tree, and what the Info column says of it.
local function show(unit, buffer, from, pinfo, parent, number, remarks, times)
    local size = unit.stop - from + 1
    local range = buffer(from - 1, size)
    local data = range:raw()
    local tree = parent:add(sac, range)
    tree:add(f.type, range, unit.kind):set_generated()
    if unit.body then read_body(unit) end
    local fact = fact_of(unit, pinfo, number, remarks, times)
    local said
    if unit.kind == "packet" then
        said = add_packet(tree, range, unit, fact, remarks, pinfo)
    elseif unit.kind == "collision" then
        said = add_collision(tree, range, data, remarks["collision with"])
    elseif unit.kind == "garbage" then
        said = add_garbage(tree, range, data, unit.words)
    else
        said = add_answer(tree, range, unit, fact)
    end
    if remarks["sender"] then tree:add(f.sender, remarks["sender"]):set_generated() end
    tree:append_text(unit.src
        and (", %s -> %s, %s"):format(name_of(unit.src), name_of(unit.dst), said)
        or (", %s"):format(said))
    return said
end

function sac.dissector(buffer, pinfo, tree)
    local size = buffer:len()
    if size == 0 then return 0 end
    local data = buffer:raw(0, size)
    local remarks = remarks_of_frame()
    local stamp = frame_time()
    local start = stamp and stamp.value or NSTime.new(0, 0)
    local whole = tonumber((remarks["on the line"] or ""):match("^(%d+) ns$") or nil)
    local infos, ways = {}, {}
    pinfo.cols.protocol = "SAC"
    local at, number = 1, 1
    while at <= size do
        local unit
        if remarks["collision with"] then
            unit = { kind = "collision", stop = size }
        elseif remarks["garbage"] then
            unit = { kind = "garbage", words = remarks["garbage"], stop = size }
        else
            unit = unit_at(data, at)
        end
        if unit.open and pinfo.can_desegment > 0 then -- of a TCP stream
            pinfo.desegment_offset = at - 1
            pinfo.desegment_len = DESEGMENT_ONE_MORE_SEGMENT
            break
        end
        local seconds = whole and at == 1 and unit.stop == size and whole / 1e9 or span(unit.stop)
        local times = { start = later(start, span(at - 1)), stop = later(start, seconds) }
        infos[#infos + 1] = show(unit, buffer, at, pinfo, tree, number, remarks, times)
        ways[#ways + 1] = unit
        at, number = unit.stop + 1, number + 1
    end
    local first = ways[1]
    if first and first.src then
        pinfo.cols.src = name_of(first.src)
        pinfo.cols.dst = name_of(first.dst)
    end
    pinfo.cols.info = table.concat(infos, " | ")
    return size
end

local encapsulations = wtap_encaps or wtap
DissectorTable.get("wtap_encap"):add(encapsulations.USER0, sac)
DissectorTable.get("tcp.port"):add_for_decode_as(sac)
