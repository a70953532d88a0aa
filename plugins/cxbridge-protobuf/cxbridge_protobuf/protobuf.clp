;;; Templates of received messages, and the rules that delete them. The names are Fawkes'. See
;;; docs/evidence/protocol-protobuf.md.

(deftemplate protobuf-msg
  "A received message. A rule that keeps the message makes another reference (pb-ref)."
  (slot type (type STRING))                             ; full name
  (slot comp-id (type INTEGER)) (slot msg-type (type INTEGER)) ; the type's numbers in frames
  (slot rcvd-via (type SYMBOL) (allowed-values STREAM BROADCAST))
  (multislot rcvd-from (cardinality 2 2))               ; host and port
  (multislot rcvd-at (type INTEGER) (cardinality 2 2))  ; seconds and microseconds
  (slot client-type (type SYMBOL) (allowed-values SERVER CLIENT PEER))
  ; id of the connection or peer, and address of the message
  (slot client-id (type INTEGER)) (slot ptr (type EXTERNAL-ADDRESS)))

(deftemplate protobuf-receive-failed
  "A client of the agent has received an unknown or invalid message."
  (slot comp-id (type INTEGER)) (slot msg-type (type INTEGER))
  (slot rcvd-via (type SYMBOL) (allowed-values STREAM BROADCAST))
  (multislot rcvd-from (cardinality 2 2))
  (slot client-id (type INTEGER)) (slot message (type STRING)))

(deftemplate protobuf-server-receive-failed
  "The server of the agent has received an unknown or invalid message."
  (slot comp-id (type INTEGER)) (slot msg-type (type INTEGER))
  (slot rcvd-via (type SYMBOL) (allowed-values STREAM BROADCAST))
  (multislot rcvd-from (cardinality 2 2))
  (slot client-id (type INTEGER)) (slot message (type STRING)))

(deffunction pb-is-broadcast (?rcvd-via) (eq ?rcvd-via BROADCAST))

(deffunction pb-print-failed (?receiver ?component ?type ?host ?port ?problem)
  (printout t ?receiver " rcv fail for " ?component ":" ?type " from " ?host ":" ?port ": " ?problem crlf))

;; These rules delete received messages, since CLIPS keeps facts forever. The salience is Fawkes'. It is low, so
;; that the agent's rules see the messages first.

(defrule protobuf-cleanup-receive-failed
  (declare (salience -4000))
  ?fact <- (protobuf-receive-failed (comp-id ?component) (msg-type ?type) (rcvd-from ?host ?port)
                                    (message ?problem))
  =>
  (retract ?fact)
  (pb-print-failed "Protobuf" ?component ?type ?host ?port ?problem))

(defrule protobuf-cleanup-server-receive-failed
  (declare (salience -4000))
  ?fact <- (protobuf-server-receive-failed (comp-id ?component) (msg-type ?type) (rcvd-from ?host ?port)
                                           (message ?problem))
  =>
  (retract ?fact)
  (pb-print-failed "Protobuf server" ?component ?type ?host ?port ?problem))

(defrule protobuf-cleanup-message
  (declare (salience -4000))
  ?fact <- (protobuf-msg (ptr ?message))
  =>
  (pb-destroy ?message)
  (retract ?fact))
