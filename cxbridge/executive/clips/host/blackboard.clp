;;; Facts about the interfaces of the blackboard.

(deftemplate blackboard-interface "An interface that this environment has opened."
  (slot id (type STRING)) (slot type (type STRING))
  (slot uid (type STRING))     ; Type::id, the argument of other functions
  (slot hash (type STRING))    ; 32 hexadecimal digits
  (slot serial (type STRING))  ; the serial of the instance, which identifies this agent to a writer
  (slot writing
    (type SYMBOL) (allowed-values FALSE TRUE)))

(deftemplate blackboard-interface-info "An interface of the blackboard at the time of (blackboard-get-info)."
  (slot id (type STRING)) (slot type (type STRING))
  (slot hash (type STRING))
  (slot has-writer
    (type SYMBOL) (allowed-values TRUE FALSE))
  (slot num-readers (type INTEGER))
  (slot writer (type STRING))        ; the name of the owner; "" without a writer
  (multislot readers (type STRING))  ; the names of the owners
  (multislot timestamp               ; of the last write
    (type INTEGER) (cardinality 2 2) (default (create$ 0 0))))
