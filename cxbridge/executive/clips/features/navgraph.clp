;;; The navigation graph as facts, and functions on them. See docs/features.md#navgraph.
;;; Positions are multifields (x y) in metres; properties are multifields (name value name value ...) of
;;; strings.

(deftemplate navgraph "The navigation graph of the node and edge facts." (slot name (type STRING)))

(deftemplate navgraph-node "A place."
  (slot name (type STRING))
  (multislot pos (type FLOAT) (cardinality 2 2))
  (multislot properties (type STRING)))

(deftemplate navgraph-edge "A way between two nodes, in both directions unless it is directed."
  (slot from (type STRING)) (slot to (type STRING))
  (slot directed (type SYMBOL) (allowed-values FALSE TRUE))
  (multislot properties (type STRING)))

(deffunction navgraph-pos-x (?pos) (nth$ 1 ?pos))

(deffunction navgraph-pos-y (?pos) (nth$ 2 ?pos))

(deffunction navgraph-pos-distance "The straight distance of two positions, in metres." (?pos1 ?pos2)
  (bind ?dx (- (nth$ 1 ?pos1) (nth$ 1 ?pos2)))
  (bind ?dy (- (nth$ 2 ?pos1) (nth$ 2 ?pos2)))
  (sqrt (+ (* ?dx ?dx) (* ?dy ?dy))))

(deffunction navgraph-closer "Whether B is closer to A than C is." (?pos-A ?pos-B ?pos-C)
  (< (navgraph-pos-distance ?pos-A ?pos-B) (navgraph-pos-distance ?pos-A ?pos-C)))

(deffunction navgraph-closest-to
  "The name of the node closest to a position, except a node at the position; FALSE if there is none."
  (?pos)
  (bind ?name FALSE)
  (bind ?least-distance 0.0)
  (do-for-all-facts ((?node navgraph-node)) (neq ?node:pos ?pos)
    (bind ?distance (navgraph-pos-distance ?pos ?node:pos))
    (if (or (not ?name) (< ?distance ?least-distance)) then
      (bind ?name ?node:name)
      (bind ?least-distance ?distance)))
  ?name)

(deffunction navgraph-closest-by-name
  "The name of the node closest to the node ?name; FALSE if there is none, or no node ?name."
  (?name)
  (do-for-fact ((?node navgraph-node)) (eq ?node:name ?name)
    (return (navgraph-closest-to ?node:pos)))
  FALSE)

(deffunction navgraph-property "The value of a property; FALSE without this property." (?properties ?name)
  (loop-for-count (?pair (div (length$ ?properties) 2))
    (if (eq (nth$ (- (* 2 ?pair) 1) ?properties) ?name) then (return (nth$ (* 2 ?pair) ?properties))))
  FALSE)

(deffunction navgraph-has-property (?properties ?name)
  (neq (navgraph-property ?properties ?name) FALSE))

(deffunction navgraph-property-as-float "The value as a FLOAT; 0.0 without this property." (?properties ?name)
  (bind ?value (navgraph-property ?properties ?name))
  (if ?value then (float (string-to-field ?value)) else 0.0))

(deffunction navgraph-property-as-int "The value as an INTEGER; 0 without this property." (?properties ?name)
  (bind ?value (navgraph-property ?properties ?name))
  (if ?value then (integer (string-to-field ?value)) else 0))

(deffunction navgraph-property-as-bool "TRUE if the value is the text true." (?properties ?name)
  (eq (navgraph-property ?properties ?name) "true"))

(deffunction navgraph-cleanup "Retract all facts about the graph." ()
  (delayed-do-for-all-facts ((?fact navgraph-node)) TRUE (retract ?fact))
  (delayed-do-for-all-facts ((?fact navgraph-edge)) TRUE (retract ?fact))
  (delayed-do-for-all-facts ((?fact navgraph)) TRUE (retract ?fact)))
